#include <flyball/simulation/linear_loop.hpp>

#include <algorithm>
#include <limits>

#include <flyball/control/feedforward.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_simulate_linear = "simulate_linear";

Expected<void> check_loop(const LinearLoop& loop, const MatrixRef& r) {
  FLYBALL_CHECK(check_system(loop.plant, in_simulate_linear));
  const Eigen::Index n = loop.plant.A.rows();
  const Eigen::Index m = loop.plant.B.cols();
  const Eigen::Index p = loop.plant.C.rows();
  FLYBALL_CHECK(
      Checks(in_simulate_linear)
          .shape(loop.K, m, n, "K", "inputs x states")
          .also([&] {
            return loop.K_e
                       ? check_shape(*loop.K_e, n, p, in_simulate_linear, "K_e", "states x outputs")
                       : Expected<void>{};
          })
          .also([&] {
            return loop.u_min.size() == 0
                       ? Expected<void>{}
                       : check_shape(loop.u_min, m, 1, in_simulate_linear, "u_min", "inputs x 1");
          })
          .also([&] {
            return loop.u_max.size() == 0
                       ? Expected<void>{}
                       : check_shape(loop.u_max, m, 1, in_simulate_linear, "u_max", "inputs x 1");
          })
          .also([&] {
            return loop.x0.size() == 0
                       ? Expected<void>{}
                       : check_shape(loop.x0, n, 1, in_simulate_linear, "x0", "states x 1");
          })
          .shape(r, n, r.cols(), "r", "states x samples"));
  return Checks(in_simulate_linear)
      .finite(loop.K, "K")
      .finite(loop.x0, "x0")
      .also([&] {
        return loop.K_e ? check_finite(*loop.K_e, in_simulate_linear, "K_e") : Expected<void>{};
      })
      .finite(r, "r");
}

/// The matrices of a loop and what a step keeps, of sizes known at compile time or not: no step
/// allocates.
template <int States, int Inputs, int Outputs>
class Steps {
  template <int Rows, int Columns>
  using Matrix = Eigen::Matrix<double, Rows, Columns>;

 public:
  Steps(const LinearLoop& loop, const Eigen::MatrixXd& B_pinv)
      : A_(loop.plant.A),
        B_(loop.plant.B),
        C_(loop.plant.C),
        D_(loop.plant.D),
        K_(loop.K),
        B_pinv_(B_pinv),
        x_(Matrix<States, 1>::Zero(A_.rows())),
        u_(Matrix<Inputs, 1>::Zero(B_.cols())),
        u_min_(bound(loop.u_min, -std::numeric_limits<double>::infinity())),
        u_max_(bound(loop.u_max, std::numeric_limits<double>::infinity())) {
    if (loop.x0.size() > 0) {
      x_ = loop.x0;
    }
    x_hat_ = x_;
    if (loop.K_e) {
      K_e_ = *loop.K_e;
    }
  }

  void run(const LinearLoop& loop, const MatrixRef& r, LinearTrajectory& result) {
    const Eigen::Index samples = r.cols();
    const double period = loop.plant.period.si();
    for (Eigen::Index k = 0; k < samples; ++k) {
      next_ = x_;
      x_.noalias() = A_ * next_;
      x_.noalias() += B_ * u_;
      y_.noalias() = C_ * x_;
      y_.noalias() += D_ * u_;
      if (loop.K_e) {
        next_ = x_hat_;
        x_hat_.noalias() = A_ * next_;
        x_hat_.noalias() += B_ * u_;
        innovation_ = y_;
        innovation_.noalias() -= C_ * x_hat_;
        innovation_.noalias() -= D_ * u_;
        x_hat_.noalias() += K_e_ * innovation_;
      } else {
        x_hat_ = x_;
      }
      r_ = r.col(k);
      next_ = r_ - x_hat_;
      u_.noalias() = K_ * next_;
      if (loop.plant_inversion) {
        next_ = r.col(std::min(k + 1, samples - 1));
        next_.noalias() -= A_ * r_;
        ahead_.noalias() = B_pinv_ * next_;
        if (ahead_.allFinite()) {  // as LinearPlantInversion, which it is
          u_ += ahead_;
        }
      }
      u_ = u_.cwiseMax(u_min_).cwiseMin(u_max_);
      result.time(k) = static_cast<double>(k) * period;
      result.x.col(k) = x_;
      result.x_hat.col(k) = x_hat_;
      result.y.col(k) = y_;
      result.u.col(k) = u_;
    }
  }

 private:
  Matrix<Inputs, 1> bound(const Eigen::VectorXd& given, double otherwise) const {
    return given.size() > 0 ? Matrix<Inputs, 1>(given)
                            : Matrix<Inputs, 1>(Matrix<Inputs, 1>::Constant(B_.cols(), otherwise));
  }

  Matrix<States, States> A_;
  Matrix<States, Inputs> B_;
  Matrix<Outputs, States> C_;
  Matrix<Outputs, Inputs> D_;
  Matrix<Inputs, States> K_;
  Matrix<States, Outputs> K_e_{};
  Matrix<Inputs, States> B_pinv_;
  Matrix<States, 1> x_, x_hat_, r_, next_;
  Matrix<Outputs, 1> y_, innovation_;
  Matrix<Inputs, 1> u_, ahead_, u_min_, u_max_;
};

/// The loop of sizes up to 3, 2 and 2 known at compile time, which mechanisms have; else of any.
template <int States = 3, int Inputs = 2, int Outputs = 2>
void run(const LinearLoop& loop, const Eigen::MatrixXd& B_pinv, const MatrixRef& r,
         LinearTrajectory& result) {
  const auto is = [](Eigen::Index size, int fixed) { return size == fixed; };
  if constexpr (States == 0) {
    Steps<Eigen::Dynamic, Eigen::Dynamic, Eigen::Dynamic>(loop, B_pinv).run(loop, r, result);
  } else if (!is(loop.plant.A.rows(), States)) {
    run<States - 1, Inputs, Outputs>(loop, B_pinv, r, result);
  } else if constexpr (Inputs == 0) {
    run<0, 0, 0>(loop, B_pinv, r, result);
  } else if (!is(loop.plant.B.cols(), Inputs)) {
    run<States, Inputs - 1, Outputs>(loop, B_pinv, r, result);
  } else if constexpr (Outputs == 0) {
    run<0, 0, 0>(loop, B_pinv, r, result);
  } else if (!is(loop.plant.C.rows(), Outputs)) {
    run<States, Inputs, Outputs - 1>(loop, B_pinv, r, result);
  } else {
    Steps<States, Inputs, Outputs>(loop, B_pinv).run(loop, r, result);
  }
}

}  // namespace

Expected<LinearTrajectory> simulate_linear(const LinearLoop& loop, const MatrixRef& r) {
  FLYBALL_CHECK(check_loop(loop, r));
  FLYBALL_TRY(const auto inversion, linear_plant_inversion(loop.plant));
  const Eigen::Index n = loop.plant.A.rows();
  const Eigen::Index samples = r.cols();
  LinearTrajectory result;
  result.time.resize(samples);
  result.x.resize(n, samples);
  result.x_hat.resize(n, samples);
  result.y.resize(loop.plant.C.rows(), samples);
  result.u.resize(loop.plant.B.cols(), samples);
  run(loop, inversion.B_pinv(), r, result);
  return result;
}

}  // namespace flyball
