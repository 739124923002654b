#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <flyball/math/expression/lagrangian.hpp>
#include <flyball/math/expression/lane_tape.hpp>

#include "optimization/ocp/riccati_kernel.hpp"
#include "optimization/solver/program.hpp"

namespace flyball::optimization::detail {

/// What happens at a stage: f (if dynamics follow), then ℓ, then g, of z = (x, u) and data.
struct StageKind {
  expression::Lagrangian functions{};
  bool has_dynamics = false;
};

/// An optimal control problem as its solver takes it: uniform sizes, kinds of stages.
struct StageProblem {
  std::size_t stages = 0;  ///< N + 1.
  std::size_t states = 0;  ///< Shared parameters included.
  std::size_t inputs = 0;
  std::vector<StageKind> kinds{};
  std::vector<std::size_t> kind{};   ///< Of each stage.
  Eigen::MatrixXd lower{}, upper{};  ///< (states + inputs) x stages; of the last stage's inputs 0.
  std::vector<double> row_lower{}, row_upper{};  ///< Of all g, stage by stage.
  Eigen::MatrixXd data{};                        ///< numbers x stages.
  Eigen::VectorXd parameters{};                  ///< Of the tapes.
  double objective_scale = 1.0;
};

/// w = (z_0, …, z_N, slacks of inequality rows), c = (defects f - x⁺, rows g - s or g - bound).
class StageProgram final : public Program {
 public:
  explicit StageProgram(StageProblem problem);

  [[nodiscard]] bool values(const Eigen::VectorXd& w, double& f, Eigen::VectorXd& c) override;
  [[nodiscard]] bool derivatives(const Eigen::VectorXd& w, const Eigen::VectorXd& lambda,
                                 double objective, Eigen::VectorXd& gradient) override;
  void multiply(const Eigen::VectorXd& dw, const Eigen::VectorXd& dl, Eigen::VectorXd& out_w,
                Eigen::VectorXd& out_c) override;
  void transpose_multiply(const Eigen::VectorXd& lambda, Eigen::VectorXd& out) override;
  [[nodiscard]] bool factor(const Eigen::VectorXd& diagonal, const Eigen::VectorXd& D,
                            bool with_hessian) override;
  void solve(const Eigen::VectorXd& rw, const Eigen::VectorXd& rc, Eigen::VectorXd& dw,
             Eigen::VectorXd& dl) override;

  /// w with the slacks at g(z). @param z  (states + inputs) x stages.
  [[nodiscard]] Eigen::VectorXd start(const Eigen::MatrixXd& z);

  [[nodiscard]] const StageProblem& problem() const noexcept { return problem_; }
  /// Data, tape parameters and bounds may change between solves; sizes and kinds, and which
  /// variables are fixed, may not.
  [[nodiscard]] StageProblem& problem() noexcept { return problem_; }
  /// After a change of the problem's numbers.
  void refresh();

  [[nodiscard]] std::size_t rows() const noexcept { return slack_.size(); }
  [[nodiscard]] std::size_t defects() const noexcept {
    return (problem_.stages - 1) * problem_.states;
  }
  /// Where a stage's rows begin.
  [[nodiscard]] const std::vector<std::size_t>& first_row() const noexcept { return first_row_; }
  /// The place of a row's slack in w, or -1.
  [[nodiscard]] std::ptrdiff_t slack(std::size_t row) const noexcept { return slack_[row]; }
  /// The first stage at which a value was not finite, or where all are a derivative, and which
  /// output of its kind; for messages.
  struct Fault {
    std::size_t stage = 0;
    std::size_t output = 0;
    bool found = false;
    bool derivative = false;
  };
  [[nodiscard]] Fault find_fault(const Eigen::VectorXd& w);

 private:
  [[nodiscard]] Fault find_derivative_fault(const Eigen::VectorXd& w);
  struct Batch {
    std::size_t kind;
    std::vector<std::size_t> stages;
  };
  struct Place {
    std::size_t output;
    std::size_t where;   // within the stage's block
    std::size_t mirror;  // of a Hessian's entry
    bool fixed;
  };
  struct Compiled {
    expression::LaneTape values;
    expression::LaneTape derivatives;
    std::vector<Place> dynamics, cost, rows, hessian;
    std::vector<double> value_work, derivative_work;
  };

  void gather(const Compiled& kind, const expression::LaneTape& tape, const std::size_t* stages,
              std::size_t count, const double* w, double* work) const;
  void make_places(Compiled& compiled, const StageKind& kind) const;

  StageProblem problem_;
  std::vector<Compiled> compiled_;
  std::vector<Batch> batches_;
  std::size_t size_ = 0;   // states + inputs
  std::size_t width_ = 0;  // of a row
  std::vector<std::size_t> first_row_;
  std::vector<std::ptrdiff_t> slack_;
  std::vector<double> row_offset_;  // what an equality row must be
  std::vector<unsigned char> fixed_;
  std::vector<double> H_, AB_, G_, P_, E_, L_, pivots_, scratch_;
  std::vector<double> weight_, weighted_, D_, p_, g_;
  Eigen::VectorXd slack_diagonal_;
  StageSystem system_;
  bool written_ = false;  // whether entries that never change stand in the blocks
};

}  // namespace flyball::optimization::detail
