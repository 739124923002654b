#include <flyball/estimation/multiple_model.hpp>

#include <cmath>
#include <string>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::detail {

Expected<void> check_modes(const MatrixRef& prior, const MatrixRef& transition, double floor) {
  constexpr std::string_view where = "ModeProbabilities";
  constexpr double rounding = 1e-9;
  const Eigen::Index n = prior.rows();
  FLYBALL_CHECK(Checks(where)
                    .finite(prior, "the prior")
                    .finite(transition, "the transition")
                    .within(floor, 0.0, 1.0 / static_cast<double>(n), "the floor"));
  for (Eigen::Index i = 0; i < n; ++i) {
    FLYBALL_CHECK(check_not_negative(prior(i, 0), where, format("prior({})", i)));
    for (Eigen::Index j = 0; j < n; ++j) {
      FLYBALL_CHECK(
          check_not_negative(transition(i, j), where, format("transition({}, {})", i, j)));
    }
    const double sum = transition.row(i).sum();
    if (!(std::abs(sum - 1.0) <= rounding)) {
      return refusal(ArgumentError::out_of_range, where, format("row {} of the transition", i))
          .got(format("of sum {}", format_number(sum)))
          .expected("of sum 1: some mode follows mode i");
    }
  }
  if (!(prior.sum() > 0.0)) {
    return refusal(ArgumentError::out_of_range, where, "the prior")
        .got("zero for every model")
        .expected("positive for one at least");
  }
  return {};
}

Expected<void> check_same_sizes(const MatrixRef& B, const MatrixRef& C, const MatrixRef& first_B,
                                const MatrixRef& first_C, std::size_t model) {
  constexpr std::string_view where = "MultipleModelFilter";
  return Checks(where)
      .shape(B, first_B.rows(), first_B.cols(), format("B of model {}", model),
             "as of the first model")
      .shape(C, first_C.rows(), first_C.cols(), format("C of model {}", model),
             "as of the first model");
}

Error in_model(Error error, std::size_t model) {
  return std::move(error).in(format("MultipleModelFilter: model {}", model));
}

}  // namespace flyball::detail
