#pragma once

#include <array>
#include <complex>
#include <optional>
#include <vector>

#include <flyball/math/integration/adaptive.hpp>

/// The two integrators behind `integrate`, one step at a time.
namespace flyball::detail {

/// What both need to know of a problem.
struct OdeProblem {
  OdeFunction f;
  const OdeJacobian* jacobian = nullptr;
  double t_end = 0.0;
  double direction = 1.0;
  double relative_tolerance = 0.0;
  Eigen::VectorXd absolute_tolerance{};
  double max_step = 0.0;
  int max_steps = 0;
  IntegrationStatistics statistics{};

  [[nodiscard]] Eigen::VectorXd derivative(double t, const Eigen::VectorXd& x);
  /// ∂f/∂x at a state whose derivative is known.
  [[nodiscard]] Eigen::MatrixXd jacobian_at(double t, const Eigen::VectorXd& x,
                                            const Eigen::VectorXd& f_of_x);
  /// The root of the mean square of e over absolute + relative tolerance · max(|x|, |y|).
  [[nodiscard]] double norm(const Eigen::VectorXd& e, const Eigen::VectorXd& x,
                            const Eigen::VectorXd& y) const;
  /// A first step from the sizes of f and its change (Hairer, Nørsett, Wanner, II.4).
  [[nodiscard]] double first_step(double t, const Eigen::VectorXd& x, const Eigen::VectorXd& f0);
};

/// Where the integration stands; a step moves it on.
struct OdeState {
  double t = 0.0;
  Eigen::VectorXd x;
  Eigen::VectorXd f;               ///< dx/dt there.
  double step = 0.0;               ///< The next one's length, positive.
  OdeSolution::Segment segment{};  ///< The last step's.
};

class DormandPrinceStepper {
 public:
  /// @errors IntegrationError.
  [[nodiscard]] Expected<void> step(OdeProblem& problem, OdeState& state);
  /// Whether stability, not accuracy, has kept the last steps small.
  [[nodiscard]] bool stiff() const noexcept { return stiff_steps_ >= 15; }

 private:
  void watch_stiffness(double h, const Eigen::VectorXd& k6, const Eigen::VectorXd& k7,
                       const Eigen::VectorXd& x6, const Eigen::VectorXd& x7);

  double previous_error_ = 1e-4;
  int stiff_steps_ = 0;
  int other_steps_ = 0;
};

/// L U = P M by Gaussian elimination with row pivoting, kept for several right sides.
template <class Scalar>
class LuFactors {
 public:
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

  explicit LuFactors(Matrix M);
  /// M⁻¹ b; not finite where M is singular.
  [[nodiscard]] Vector solve(Vector b) const;

 private:
  Matrix LU_;
  std::vector<Eigen::Index> rows_;
};

class RadauStepper {
 public:
  /// @errors IntegrationError.
  [[nodiscard]] Expected<void> step(OdeProblem& problem, OdeState& state);

 private:
  struct Newton {
    bool converged = false;
    int iterations = 0;
    double rate = 0.0;
    Eigen::MatrixXd Z;  ///< n x 3: the stages minus x.
  };
  void factorize(OdeProblem& problem, double h);
  [[nodiscard]] Newton solve_stages(OdeProblem& problem, const OdeState& state, double h,
                                    const Eigen::MatrixXd& guess) const;
  [[nodiscard]] Newton converge(OdeProblem& problem, const OdeState& state, double h);
  [[nodiscard]] double growth(double step, double error) const;

  std::optional<Eigen::MatrixXd> J_;
  bool J_is_current_ = false;
  double factored_step_ = 0.0;
  std::optional<LuFactors<double>> real_;
  std::optional<LuFactors<std::complex<double>>> complex_;
  double previous_step_ = 0.0;   ///< 0: none.
  double previous_error_ = 0.0;  ///< 0: none.
};

/// Where the next step ends, or the error of one that became too small, or of one too many.
[[nodiscard]] Expected<double> next_time(const OdeProblem& problem, const OdeState& state,
                                         bool was_not_finite);

}  // namespace flyball::detail
