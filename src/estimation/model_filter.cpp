#include <flyball/estimation/model_filter.hpp>

#include "core/try.hpp"

namespace flyball::detail {

Expected<void> check_model_filter(const MatrixRef& Q, const MatrixRef& x_hat, Eigen::Index states,
                                  Eigen::Index inputs, Eigen::Index outputs,
                                  Eigen::Index noise_rows, const Eigen::MatrixXd* input_noise,
                                  Time period) {
  constexpr std::string_view where = "ModelFilter";
  FLYBALL_CHECK(Checks(where)
                    .shape(x_hat, states, 1, "x_hat", "states x 1")
                    .finite(x_hat, "x_hat")
                    .shape(Q, states, states, "Q", "states x states")
                    .also([&] { return check_covariance(Q, where, "Q"); })
                    .positive(period.si(), "period", "s"));
  if (noise_rows != outputs) {
    return check_shape(Eigen::MatrixXd(noise_rows, noise_rows), outputs, outputs, where, "R",
                       "outputs x outputs");
  }
  if (input_noise != nullptr) {
    FLYBALL_CHECK(Checks(where)
                      .shape(*input_noise, inputs, inputs, "input_noise", "inputs x inputs")
                      .also([&] { return check_covariance(*input_noise, where, "input_noise"); }));
  }
  return {};
}

}  // namespace flyball::detail
