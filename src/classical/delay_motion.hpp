#pragma once

#include <deque>
#include <map>
#include <vector>

#include <flyball/classical/delay_response.hpp>

#include "classical/collocation.hpp"

/// How a continuous system with dead time moves.
namespace flyball::classical::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Jumps of derivatives of this order and above are left to the choice of the step.
constexpr int smooth = 7;

/// What moves a system: samples, or an impulse at t = 0.
struct Drive {
  const MatrixXd& u;  ///< samples x inputs
  InputShape shape = InputShape::held;
  Index impulse = -1;
};

/// The orders of the derivatives that jump at an instant, and impulses among the delayed signals.
struct Break {
  int input = smooth;
  Eigen::VectorXi delayed;
  VectorXd impulse;  ///< Empty without one.
};

/// Polynomials of the delayed signals' sources over a step.
struct Segment {
  double begin = 0.0;
  double length = 0.0;
  MatrixXd z;  ///< p x delays, Legendre coefficients.
};

/// Values at the nodes of a step: x = P x(0) + Q [u; w], the inputs' values at the nodes below each
/// other; of one longer than a delay [x; w], with a w of zero where it is of the step itself.
struct Propagator {
  MatrixXd P;
  MatrixXd Q;
};

/// Is told the outputs step by step, as polynomials.
class OutputPieces {
 public:
  OutputPieces() = default;
  OutputPieces(const OutputPieces&) = delete;
  OutputPieces& operator=(const OutputPieces&) = delete;
  virtual ~OutputPieces() = default;
  /// @param modes  p x outputs, Legendre coefficients over [begin, begin + length], s.
  virtual void add(double begin, double length, const MatrixXd& modes) = 0;
};

/// The method of steps.
class Motion {
 public:
  /// @param pieces  Takes the outputs between the samples; null: nobody.
  Motion(const DelaySystem& system, Drive drive, double step, Index samples,
         OutputPieces* pieces = nullptr);

  Expected<DelayResponse> run(const VectorXd& x0);

 private:
  static MatrixXd beside(const MatrixXd& left, const MatrixXd& right);

  [[nodiscard]] double sample_time(Index k) const { return step_ * static_cast<double>(k); }
  /// Instants that are the same but for the rounding of sums of delays.
  [[nodiscard]] double same() const { return 1e-13 * (end_ + step_) + 1e-300; }

  Break& break_at(double time);

  void schedule_inputs();

  [[nodiscard]] double slope(Index k, Index j) const;

  /// u(t) on the step that begins at t₀.
  [[nodiscard]] VectorXd input(double begin, double t) const;

  /// Jumps that arrive now, and where they arrive next.
  void pass_breaks();

  void add_output_impulse(const VectorXd& strength);

  /// wᵢ on the step that begins at t₀, at t: zᵢ(t - τᵢ) from the segment that holds the step.
  [[nodiscard]] double delayed(Index i, double begin, double t) const;

  /// Whether at node i of a step what comes out of delay d went in during the step.
  [[nodiscard]] bool reaches_into(Index i, Index d, double length) const;

  const Propagator& propagator(double length);

  /// From here to a place, in equal steps of at most the wanted length.
  Expected<void> cross(double until);

  /// False where the step is too long.
  bool take_step(double length, double end);

  void take_sample(double begin, double t, const VectorXd& x);

  DelayForm form_;
  Drive drive_;
  OutputPieces* pieces_;
  double step_;
  double end_;
  Index samples_;
  Collocation collocation_;
  VectorXd scaling_{};
  double shortest_ = 0.0;
  double work_ = 0.0;    ///< What is left, in steps.
  double wanted_ = 0.0;  ///< Length of a step.
  int patience_ = 3;
  int accepted_ = 0;
  double t_ = 0.0;
  VectorXd x_{};
  VectorXd start_impulse_{};
  VectorXd largest_x_{};
  VectorXd largest_z_{};
  std::map<double, Break> breaks_{};
  std::deque<Segment> segments_{};
  std::map<long long, Propagator> propagators_{};
  Index next_sample_ = 0;
  DelayResponse response_{};
};

}  // namespace flyball::classical::detail
