#include <flyball/simulation/linear_loop.hpp>

#include <algorithm>
#include <limits>

#include <flyball/control/feedforward.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view where = "simulate_linear";

Expected<void> check_loop(const LinearLoop& loop, const MatrixRef& r) {
  FLYBALL_CHECK(check_system(loop.plant, where));
  const Eigen::Index n = loop.plant.A.rows();
  const Eigen::Index m = loop.plant.B.cols();
  const Eigen::Index p = loop.plant.C.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(loop.K, m, n, "K", "inputs x states")
                    .also([&] {
                      return loop.K_e
                                 ? check_shape(*loop.K_e, n, p, where, "K_e", "states x outputs")
                                 : Expected<void>{};
                    })
                    .also([&] {
                      return loop.u_min.size() == 0
                                 ? Expected<void>{}
                                 : check_shape(loop.u_min, m, 1, where, "u_min", "inputs x 1");
                    })
                    .also([&] {
                      return loop.u_max.size() == 0
                                 ? Expected<void>{}
                                 : check_shape(loop.u_max, m, 1, where, "u_max", "inputs x 1");
                    })
                    .also([&] {
                      return loop.x0.size() == 0
                                 ? Expected<void>{}
                                 : check_shape(loop.x0, n, 1, where, "x0", "states x 1");
                    })
                    .shape(r, n, r.cols(), "r", "states x samples"));
  return Checks(where)
      .finite(loop.K, "K")
      .finite(loop.x0, "x0")
      .also([&] { return loop.K_e ? check_finite(*loop.K_e, where, "K_e") : Expected<void>{}; })
      .finite(r, "r");
}

}  // namespace

Expected<LinearTrajectory> simulate_linear(const LinearLoop& loop, const MatrixRef& r) {
  FLYBALL_CHECK(check_loop(loop, r));
  const auto& [A, B, C, D, period] = loop.plant;
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  const Eigen::Index samples = r.cols();
  FLYBALL_TRY(auto inversion, linear_plant_inversion(loop.plant));
  const double infinity = std::numeric_limits<double>::infinity();
  const Eigen::VectorXd u_min =
      loop.u_min.size() == 0 ? Eigen::VectorXd::Constant(m, -infinity).eval() : loop.u_min;
  const Eigen::VectorXd u_max =
      loop.u_max.size() == 0 ? Eigen::VectorXd::Constant(m, infinity).eval() : loop.u_max;

  LinearTrajectory result;
  result.time.resize(samples);
  result.x.resize(n, samples);
  result.x_hat.resize(n, samples);
  result.y.resize(C.rows(), samples);
  result.u.resize(m, samples);
  Eigen::VectorXd x = loop.x0.size() == 0 ? Eigen::VectorXd::Zero(n).eval() : loop.x0;
  Eigen::VectorXd x_hat = x;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(m);
  for (Eigen::Index k = 0; k < samples; ++k) {
    x = (A * x + B * u).eval();
    const Eigen::VectorXd y = C * x + D * u;
    if (loop.K_e) {
      x_hat = (A * x_hat + B * u).eval();
      x_hat += *loop.K_e * (y - C * x_hat - D * u);
    } else {
      x_hat = x;
    }
    const Eigen::VectorXd r_now = r.col(k);
    const Eigen::VectorXd r_next = r.col(std::min(k + 1, samples - 1));
    u = loop.K * (r_now - x_hat);
    if (loop.plant_inversion) {
      u += inversion.calculate(r_now, r_next);
    }
    u = u.cwiseMax(u_min).cwiseMin(u_max).eval();
    result.time(k) = static_cast<double>(k) * period.si();
    result.x.col(k) = x;
    result.x_hat.col(k) = x_hat;
    result.y.col(k) = y;
    result.u.col(k) = u;
  }
  return result;
}

}  // namespace flyball
