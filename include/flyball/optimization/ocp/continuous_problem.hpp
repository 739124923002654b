#pragma once

#include <memory>
#include <string>
#include <utility>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/math/expression/tape.hpp>
#include <flyball/optimization/ocp/optimal_control.hpp>

/// Optimal control in continuous time, stated once, whatever it is solved by.
namespace flyball::optimization {

namespace detail {
struct ContinuousData;
}  // namespace detail

/// An optimal control problem in one or several phases i = 0 … P-1 of durations T_i:
///
///   minimise  Σ_i ∫ ℓ_i(x, u, T) dt + φ(x(end), T) + w Σ_i T_i
///   subject to  ẋ = f_i(x, u, T),  path constraints lower ≤ g(x, u, T) ≤ upper all along,
///   constraints at the ends of phases, and x⁺ = j_i(x⁻) where a phase begins with a jump.
///
/// It says nothing of meshes and methods: those are chosen where it is solved (`solve`), so one
/// statement serves direct transcription, shooting and collocation. Functions are generic lambdas,
/// models of the house or tapes of formulas; a lambda takes (x), (x, u) or (x, u, T), T being the
/// durations of all phases. Each is recorded once: they must not branch on values. A phase of -1
/// means all phases.
///
/// ```
/// ContinuousProblem problem(2, 1);
/// problem.set_derivative([](const auto& x, const auto& u) { return std::array{x(1), u(0)}; });
/// problem.bound_inputs(Eigen::VectorXd::Constant(1, -1.0), Eigen::VectorXd::Constant(1, 1.0));
/// problem.fix_start(Eigen::Vector2d(0.0, 0.0));
/// problem.fix_end(Eigen::Vector2d(1.0, 0.0));
/// problem.free_duration(0.1, 10.0, 3.0);
/// problem.minimize_time();
/// const auto solution = solve(problem).value();  // 2 s, full ahead and full astern
/// ```
///
/// What is wrong with a statement (shapes, bounds that contradict each other, numbers that are not
/// finite) is kept and told by `solve`.
class ContinuousProblem {
 public:
  /// Which end of a phase.
  enum class End : unsigned char { start, end };

  /// @param states, inputs  n and m. @param phases  P.
  ContinuousProblem(int states, int inputs, int phases = 1);
  ContinuousProblem(const ContinuousProblem& other);
  ContinuousProblem(ContinuousProblem&&) noexcept;
  ContinuousProblem& operator=(const ContinuousProblem& other);
  ContinuousProblem& operator=(ContinuousProblem&&) noexcept;
  ~ContinuousProblem();

  /// ẋ = f. @param f  A model, or a function that returns n expressions.
  template <class F>
  void set_derivative(const F& f, int phase = -1) {
    if constexpr (std::is_same_v<F, expression::Tape>) {
      take_derivative(f, phase);
    } else {
      record_derivative(OptimalControlProblem::recorder(f), phase);
    }
  }
  /// ℓ, integrated over a phase. @param f  Returns an expression.
  template <class F>
  void set_running_cost(const F& f, int phase = -1) {
    record_running_cost(OptimalControlProblem::recorder(f), phase);
  }
  /// φ at the end of the last phase. @param f  Of (x) or, u being zero there, (x, u, T).
  template <class F>
  void set_final_cost(const F& f) {
    record_final_cost(OptimalControlProblem::recorder(f));
  }
  /// lower ≤ g ≤ upper all along a phase, entry by entry. It holds at the mesh's points.
  /// @param name  For messages.
  template <class F>
  void add_path_constraint(const F& g, const Eigen::Ref<const Eigen::VectorXd>& lower,
                           const Eigen::Ref<const Eigen::VectorXd>& upper, std::string name = {},
                           int phase = -1) {
    record_path(OptimalControlProblem::recorder(g), lower, upper, std::move(name), phase);
  }
  /// lower ≤ g(x) ≤ upper at one end of a phase. @param g  Of (x) or, u being zero, (x, u, T).
  template <class F>
  void add_end_constraint(const F& g, const Eigen::Ref<const Eigen::VectorXd>& lower,
                          const Eigen::Ref<const Eigen::VectorXd>& upper, int phase, End end,
                          std::string name = {}) {
    record_end(OptimalControlProblem::recorder(g), lower, upper, phase, end, std::move(name));
  }
  /// A phase begins at j(x) where x ended the phase before. @param phase  1 or more.
  template <class F>
  void set_jump(const F& j, int phase) {
    record_jump(OptimalControlProblem::recorder(j), phase);
  }
  /// (x_i, x_j) stays out of a disc: an obstacle. @param radius  With all that has to be clear.
  void keep_out(int i, int j, const Eigen::Vector2d& center, double radius, std::string name = {},
                int phase = -1);

  /// Bounds all along; infinite entries are none.
  ///@{
  void bound_states(const Eigen::Ref<const Eigen::VectorXd>& lower,
                    const Eigen::Ref<const Eigen::VectorXd>& upper, int phase = -1);
  void bound_inputs(const Eigen::Ref<const Eigen::VectorXd>& lower,
                    const Eigen::Ref<const Eigen::VectorXd>& upper, int phase = -1);
  ///@}
  /// The state at the start, or at the end of a phase (-1: of the last). NaN entries stay free.
  ///@{
  void fix_start(const Eigen::Ref<const Eigen::VectorXd>& state);
  void fix_end(const Eigen::Ref<const Eigen::VectorXd>& state, int phase = -1);
  ///@}

  /// A phase of a fixed duration, s.
  void set_duration(double seconds, int phase = -1);
  /// Of a free one. @param least, most  Its bounds, s. @param guess  Where the search starts, s.
  void free_duration(double least, double most, double guess, int phase = -1);
  /// A phase that takes as long as another. @param other  One before it.
  void share_duration(int phase, int other);
  /// Adds weight times the whole duration to the cost.
  void minimize_time(double weight = 1.0);

  /// Where the search starts, at shares 0 … 1 of a phase's duration and linear in between. Without
  /// it states lead straight from the start to the end, and inputs are zero.
  /// @param states  n x shares. @param inputs  m x shares, or empty.
  void set_guess(const Eigen::Ref<const Eigen::VectorXd>& shares,
                 const Eigen::Ref<const Eigen::MatrixXd>& states,
                 const Eigen::Ref<const Eigen::MatrixXd>& inputs, int phase = 0);

  [[nodiscard]] int states() const noexcept;
  [[nodiscard]] int inputs() const noexcept;
  [[nodiscard]] int phases() const noexcept;
  /// What was told. @private
  [[nodiscard]] const detail::ContinuousData& data() const noexcept { return *data_; }

 private:
  void take_derivative(const expression::Tape& f, int phase);
  void record_derivative(detail::StageFunction f, int phase);
  void record_running_cost(detail::StageFunction f, int phase);
  void record_final_cost(detail::StageFunction f);
  void record_path(detail::StageFunction g, const Eigen::Ref<const Eigen::VectorXd>& lower,
                   const Eigen::Ref<const Eigen::VectorXd>& upper, std::string name, int phase);
  void record_end(detail::StageFunction g, const Eigen::Ref<const Eigen::VectorXd>& lower,
                  const Eigen::Ref<const Eigen::VectorXd>& upper, int phase, End end,
                  std::string name);
  void record_jump(detail::StageFunction j, int phase);
  /// The phases that a number means; refuses one that there is not.
  [[nodiscard]] std::pair<int, int> range(int phase, std::string_view what);
  [[nodiscard]] expression::Tape record(detail::StageFunction f, int rows, std::string_view what);

  std::unique_ptr<detail::ContinuousData> data_;
};

}  // namespace flyball::optimization
