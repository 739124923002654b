#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <tuple>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/core/function_ref.hpp>

/// Integration of dx/dt = f(t, x) to an accuracy, stiff or not, with the solution between the steps
/// and the instants of events. For design and simulation; the control loop takes integration.hpp.
namespace flyball {

/// Why an integration ended early.
enum class IntegrationError {
  not_finite,      ///< f, or an event's function, gave NaN or infinity where no step avoids it.
  step_underflow,  ///< The step that the tolerance asks for is lost in rounding: a singularity.
  too_many_steps,  ///< The cap of the options.
  no_convergence,  ///< The stages of an implicit step were not found.
};
[[nodiscard]] ErrorInfo error_info(IntegrationError code);

/// How to integrate.
enum class IntegrationMethod {
  automatic,       ///< Dormand-Prince; from where the system is stiff, Radau IIA.
  dormand_prince,  ///< Explicit, order 5 (Theorem 7.9.3).
  radau,           ///< Radau IIA, implicit, order 5, L-stable: for stiff systems.
};

/// How accurately, and how far to go for it.
struct IntegrationOptions {
  IntegrationMethod method = IntegrationMethod::automatic;
  double relative_tolerance = 1e-6;  ///< Of the error of a step, at least 100 ε = 2.3e-14.
  double absolute_tolerance = 1e-9;  ///< In the states' units, positive.
  /// One a state instead of the one above; or empty.
  Eigen::VectorXd absolute_tolerances{};
  double initial_step = 0.0;                                  ///< s; 0: from f.
  double max_step = std::numeric_limits<double>::infinity();  ///< s.
  int max_steps = 100'000;                                    ///< Accepted and rejected ones.
};

/// Which zero crossings of an event's function count, in the direction of integration.
enum class EventDirection { any, rising, falling };

/// Something that happens where g(t, x) crosses zero: `Event{[](double, const auto& x) { return
/// x(0); }, EventDirection::falling, true}`.
template <class Function>
struct Event {
  Function function;  ///< double g(double t, x), continuous.
  EventDirection direction = EventDirection::any;
  bool terminal = false;  ///< Whether the integration ends there.
};
/// @private Lets the function decide the type.
template <class Function>
Event(Function, EventDirection = EventDirection::any, bool = false) -> Event<Function>;

/// A crossing that was found.
struct EventOccurrence {
  std::size_t event = 0;  ///< Place among the events given.
  double t = 0.0;         ///< s
  Eigen::VectorXd x;      ///< The state there.
};

/// What it cost.
struct IntegrationStatistics {
  int steps = 0;           ///< Accepted.
  int rejected = 0;        ///< Tried in vain.
  int evaluations = 0;     ///< Of f, those for differences included.
  int jacobians = 0;       ///< Formed.
  int factorizations = 0;  ///< Of a real and a complex matrix each.
  /// From when the system was treated as stiff, s; NaN: never.
  double stiff_from = std::numeric_limits<double>::quiet_NaN();
};

/// A solution x(t) on an interval, whole: the steps, and a polynomial between each two.
class OdeSolution {
 public:
  /// One step's continuous extension, for the integrators.
  struct Segment {
    double t = 0.0;     ///< Where it begins.
    double h = 0.0;     ///< Its length, negative for a backward integration.
    Eigen::MatrixXd r;  ///< n x 5, with s = (time - t)/h: x = r₀ + s(r₁ + (1 - s)(r₂ +
                        ///< s(r₃ + (1 - s) r₄))).
    /// The state at t + s h.
    [[nodiscard]] Eigen::VectorXd at(double s) const;
  };

  /// Where an integration starts, before its first step.
  OdeSolution(double t, const Eigen::VectorXd& x);

  /// x at a time, of order 4 (Dormand-Prince) or 3 (Radau IIA) in the step; outside the interval
  /// the state at its nearer end. Cost: O(n + log steps), allocates.
  [[nodiscard]] Eigen::VectorXd at(double t) const;
  /// The times of the steps, the first and the last included, s.
  [[nodiscard]] const std::vector<double>& times() const noexcept { return times_; }
  /// The states there, one column a time.
  [[nodiscard]] Eigen::MatrixXd states() const;
  [[nodiscard]] double final_time() const noexcept { return times_.back(); }
  [[nodiscard]] const Eigen::VectorXd& final_state() const noexcept { return states_.back(); }
  /// In the order in which they happened.
  [[nodiscard]] const std::vector<EventOccurrence>& events() const noexcept { return events_; }
  /// Whether a terminal event ended it before the time asked for.
  [[nodiscard]] bool ended_by_event() const noexcept { return ended_by_event_; }
  [[nodiscard]] const IntegrationStatistics& statistics() const noexcept { return statistics_; }

 private:
  friend class OdeIntegrator;

  std::vector<double> times_;
  std::vector<Eigen::VectorXd> states_;
  std::vector<Segment> segments_;
  std::vector<EventOccurrence> events_;
  bool ended_by_event_ = false;
  IntegrationStatistics statistics_;
};

/// How compiled code sees a system: dx/dt into the last argument.
using OdeFunction = FunctionRef<void(double, const Eigen::Ref<const Eigen::VectorXd>&,
                                     Eigen::Ref<Eigen::VectorXd>)>;
/// ∂f/∂x, n x n, into the last argument.
using OdeJacobian = FunctionRef<void(double, const Eigen::Ref<const Eigen::VectorXd>&,
                                     Eigen::Ref<Eigen::MatrixXd>)>;
/// How compiled code sees an event.
struct EventRef {
  FunctionRef<double(double, const Eigen::Ref<const Eigen::VectorXd>&)> function;  ///< g(t, x)
  EventDirection direction = EventDirection::any;
  bool terminal = false;
};

/// The compiled core of `integrate`. @param jacobian  Or null: by differences.
/// @param events  `event_count` of them, or null. @errors As `integrate`.
[[nodiscard]] Expected<OdeSolution> integrate_ode(OdeFunction f, const OdeJacobian* jacobian,
                                                  double t0,
                                                  const Eigen::Ref<const Eigen::VectorXd>& x0,
                                                  double t1, const IntegrationOptions& options,
                                                  const EventRef* events, std::size_t event_count);

/// x(t) from t0 to t1 of dx/dt = f(t, x), x(t0) = x0.
///
/// Dormand-Prince 5(4) with PI step control and, where the options leave the choice and the
/// eigenvalues keep the step at the border of stability, Radau IIA of order 5 from there on: its
/// simplified Newton iteration keeps the Jacobian and its factors as long as they serve. The
/// error of each step is held below absolute + relative tolerance · |x| in the mean square over the
/// states. The last step ends at t1 exactly.
///
/// @param f   f(t, x), a vector of the shape of x0. If it has a member `jacobian(t, x)`, as
///            `with_exact_jacobian(f)` of differentiation.hpp has, that is taken for ∂f/∂x;
///            otherwise differences are.
/// @param t0, t1  s; t1 < t0 integrates backward.
/// @param x0  n x 1, fixed or dynamic.
/// @param events  Any number of `Event`s. Each step is searched in four parts for a change of sign,
///            which is then found on the continuous extension to a few units of the last place of
///            t. One that is zero at t0 has not happened.
/// @errors    IntegrationError, each with t and x as evidence; ArgumentError for times, states and
///            tolerances that are not finite, or not positive.
/// Cost: six calls of f a step; allocates.
/// Source: book, Theorem 7.9.3 (Snippet 7.2 adds the step to the elapsed time only after it has
/// overwritten it; here it is added first); Hairer, Nørsett, Wanner, "Solving Ordinary Differential
/// Equations I", II.4 to II.6, and II, IV.2, IV.8.
template <class F, class Derived, class... Functions>
[[nodiscard]] Expected<OdeSolution> integrate(const F& f, double t0,
                                              const Eigen::MatrixBase<Derived>& x0, double t1,
                                              const IntegrationOptions& options = {},
                                              const Event<Functions>&... events) {
  using State = Eigen::Matrix<double, Derived::RowsAtCompileTime, 1>;
  using Ref = Eigen::Ref<const Eigen::VectorXd>;
  const auto derivative = [&f](double t, const Ref& x, Eigen::Ref<Eigen::VectorXd> dxdt) {
    dxdt = f(t, State(x));
  };
  const auto functions = std::make_tuple(
      [&events](double t, const Ref& x) { return double(events.function(t, State(x))); }...);
  // An array has one entry at least; this one is not counted.
  const auto none = [](double, const Ref&) { return 1.0; };
  const auto run = [&](const OdeJacobian* jacobian) {
    return std::apply(
        [&](const auto&... function) {
          const std::array<EventRef, sizeof...(events) + 1> refs{
              EventRef{function, events.direction, events.terminal}..., EventRef{none}};
          return integrate_ode(derivative, jacobian, t0, State(x0), t1, options, refs.data(),
                               sizeof...(events));
        },
        functions);
  };
  if constexpr (requires(const State& x) { f.jacobian(t0, x); }) {
    const auto jacobian = [&f](double t, const Ref& x, Eigen::Ref<Eigen::MatrixXd> J) {
      J = f.jacobian(t, State(x));
    };
    const OdeJacobian reference(jacobian);
    return run(&reference);
  } else {
    return run(nullptr);
  }
}

}  // namespace flyball
