#pragma once

#include <memory>
#include <utility>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/core/signal.hpp>
#include <flyball/core/sizes.hpp>
#include <flyball/systems/model_tape.hpp>

/// Predictive control: each period the best inputs over a horizon, the first of which is applied.
namespace flyball {

/// What a predictive controller must keep, and how far it looks. Vectors that are left empty bound
/// nothing, as infinite entries do.
struct MpcSettings {
  int horizon = 20;          ///< N, periods, 1 to 1000.
  Eigen::VectorXd u_min{};   ///< m, limits of the inputs.
  Eigen::VectorXd u_max{};   ///< m, above u_min.
  Eigen::VectorXd du_min{};  ///< m, <= 0: change of the input in a period.
  Eigen::VectorXd du_max{};  ///< m, >= 0.
  Eigen::VectorXd x_min{};   ///< n, limits of the states one period on and later.
  Eigen::VectorXd x_max{};   ///< n, above x_min.
  /// n, >= 0: what it costs to violate a state's limit by ε, σ ε + ½ ρ ε² a period. Both empty: so
  /// much that limits are violated only where no inputs keep them. A σ above the limit's multiplier
  /// keeps it where it can be kept; ρ alone trades violation for the rest of the cost.
  Eigen::VectorXd sigma{};
  Eigen::VectorXd rho{};  ///< n, >= 0.
  /// n x n: weight of the state at the end. Empty: of linear plants the Riccati equation's
  /// solution, with which a controller that meets no limit is the LQR; of others Q.
  Eigen::MatrixXd Q_end{};
};

/// How an answer came about.
enum class MpcStatus : unsigned char {
  optimal,   ///< To rounding, or to 1e-8 where limits of states count.
  softened,  ///< Likewise; a limit of a state cannot be kept, or is not worth it.
  capped,    ///< The caps on iterations are reached: within the inputs' limits, not optimal.
  held,      ///< The state, or a model's answer, is not of finite numbers: the input before, within
             ///< the limits.
};

namespace detail {

/// The part of predictive controllers that is compiled once, for any size.
class MpcCore {
 public:
  /// @errors As `LinearMpc::create`.
  [[nodiscard]] static Expected<MpcCore> make(const MatrixRef& A, const MatrixRef& B,
                                              const MatrixRef& Q, const MatrixRef& R,
                                              const MpcSettings& settings);
  /// @errors As `NonlinearMpc::create`.
  [[nodiscard]] static Expected<MpcCore> make(const ModelTape& model, Time period,
                                              const MatrixRef& Q, const MatrixRef& R,
                                              const MpcSettings& settings);
  MpcCore(const MpcCore& other);
  MpcCore(MpcCore&&) noexcept;
  MpcCore& operator=(const MpcCore& other);
  MpcCore& operator=(MpcCore&&) noexcept;
  ~MpcCore();

  /// @param x  n numbers. @param u  m numbers, written.
  MpcStatus calculate(const double* x, double* u) noexcept;
  /// @param r, u_r  Of all stages.
  bool set_reference(const double* r, const double* u_r) noexcept;
  /// @param r  N + 1 columns. @param u_r  N columns.
  bool set_trajectory(const double* r, const double* u_r) noexcept;
  bool set_disturbance(const double* d) noexcept;
  bool set_input_limits(const double* u_min, const double* u_max) noexcept;
  bool set_last_input(const double* u) noexcept;
  void reset() noexcept;

  [[nodiscard]] const double* state(int k) const noexcept;
  [[nodiscard]] const double* input(int k) const noexcept;
  [[nodiscard]] double cost() const noexcept;
  [[nodiscard]] double violation() const noexcept;
  [[nodiscard]] double change() const noexcept;
  [[nodiscard]] int iterations() const noexcept;
  [[nodiscard]] const MpcSettings& settings() const noexcept;
  [[nodiscard]] int states() const noexcept;
  [[nodiscard]] int inputs() const noexcept;
  /// Of a linear plant; empty otherwise.
  [[nodiscard]] const Eigen::MatrixXd& A() const noexcept;
  [[nodiscard]] const Eigen::MatrixXd& B() const noexcept;
  [[nodiscard]] const Eigen::MatrixXd& Q() const noexcept;
  [[nodiscard]] const Eigen::MatrixXd& R() const noexcept;

 private:
  struct Parts;
  explicit MpcCore(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace detail

/// What predictive controllers have in common: see `LinearMpc` and `NonlinearMpc`, which are made
/// by their factories.
template <int States, int Inputs>
class PredictiveController {
 public:
  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;

  /// One period. @param x  The state or its estimate. @return u, until the next call.
  const InputVector& calculate(const StateVector& x) noexcept {
    status_ = core_.calculate(x.data(), u_.data());
    return u_;
  }
  /// A vector of another size.
  template <class X>
    requires wrong_size<X, StateVector>
  const InputVector& calculate(const X&) = delete;

  /// Where the states are to be, and the inputs that hold them there. @return  Whether it was
  /// taken: what is not of finite numbers is not.
  bool set_reference(const StateVector& r, const InputVector& u_r) noexcept {
    return core_.set_reference(r.data(), u_r.data());
  }
  /// The same of each period of the horizon. @param r  n x (N + 1). @param u_r  m x N.
  bool set_trajectory(const Eigen::Matrix<double, States, Eigen::Dynamic>& r,
                      const Eigen::Matrix<double, Inputs, Eigen::Dynamic>& u_r) noexcept {
    const int N = horizon();
    return r.rows() == core_.states() && r.cols() == N + 1 && u_r.rows() == core_.inputs() &&
           u_r.cols() == N && core_.set_trajectory(r.data(), u_r.data());
  }
  /// Other limits, such as those of a rail that sags. @return  Whether they were taken: entries
  /// that were finite stay so, and u_min <= u_max.
  bool set_input_limits(const InputVector& u_min, const InputVector& u_max) noexcept {
    return core_.set_input_limits(u_min.data(), u_max.data());
  }
  /// What was applied in the period before, if that was not the answer; rates count from it.
  bool set_last_input(const InputVector& u) noexcept { return core_.set_last_input(u.data()); }
  /// Forgets the last solution (a cold start) and takes the input before for zero, within the
  /// limits.
  void reset() noexcept { core_.reset(); }

  [[nodiscard]] MpcStatus status() const noexcept { return status_; }
  /// x_k of the last solution. @param k  0 to N.
  [[nodiscard]] Eigen::Map<const StateVector> predicted_state(int k) const noexcept {
    return Eigen::Map<const StateVector>(core_.state(k), core_.states());
  }
  /// u_k of the last solution. @param k  0 to N - 1.
  [[nodiscard]] Eigen::Map<const InputVector> predicted_input(int k) const noexcept {
    return Eigen::Map<const InputVector>(core_.input(k), core_.inputs());
  }
  /// What the last solution costs, its violations included.
  [[nodiscard]] double cost() const noexcept { return core_.cost(); }
  /// By how much it violates a state's limit at most.
  [[nodiscard]] double violation() const noexcept { return core_.violation(); }
  /// Sets of active limits and steps of the interior-point method that it took.
  [[nodiscard]] int iterations() const noexcept { return core_.iterations(); }
  [[nodiscard]] int horizon() const noexcept { return core_.settings().horizon; }
  [[nodiscard]] const MpcSettings& settings() const noexcept { return core_.settings(); }
  /// For what is generated from it. @private
  [[nodiscard]] const detail::MpcCore& core() const noexcept { return core_; }

 protected:
  /// What a factory made.
  explicit PredictiveController(detail::MpcCore&& core)
      : core_(std::move(core)), u_(InputVector::Zero(core_.inputs())) {}

  detail::MpcCore core_;  ///< @private

 private:
  InputVector u_;
  MpcStatus status_ = MpcStatus::optimal;
};

}  // namespace flyball
