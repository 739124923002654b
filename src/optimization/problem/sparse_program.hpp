#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include <flyball/math/expression/lagrangian.hpp>
#include <flyball/math/expression/lane_tape.hpp>

#include "optimization/problem/flat_problem.hpp"
#include "optimization/problem/stage_factor.hpp"
#include "optimization/solver/program.hpp"
#include "optimization/solver/sparse_ldlt.hpp"

namespace flyball::optimization::detail {

/// A flat problem with its derivatives in sparse matrices: w = (x, a slack for each inequality),
/// c = rows less slacks. Rows and cost are scaled where their slopes at the start are above 100.
class SparseProgram final : public Program {
 public:
  explicit SparseProgram(FlatProblem flat);

  /// Takes the numbers of a problem of the same structure. @return false, and nothing taken, if it
  /// is another structure.
  [[nodiscard]] bool update(FlatProblem& flat);
  /// Takes what parameters have made of the numbers. @return false, and its numbers of no use
  /// until `update`, where that must be flattened anew.
  [[nodiscard]] bool renew(const ExpressionGraph& graph, const Expression& cost,
                           const Constraints& constraints);

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

  [[nodiscard]] bool roll(const Eigen::VectorXd& w, Eigen::VectorXd& side,
                          Eigen::VectorXd& dw) override;

  /// w of x: x moved to fixed values, slacks at their rows. Sets the scales of rows and cost.
  [[nodiscard]] Eigen::VectorXd start(const std::vector<double>& x);
  [[nodiscard]] const FlatProblem& flat() const noexcept { return flat_; }
  [[nodiscard]] double objective_scale() const noexcept { return objective_scale_; }
  [[nodiscard]] double row_scale(int row) const {
    return row_scale_[static_cast<std::size_t>(row)];
  }
  /// Whether the cost is quadratic at most and all rows are linear.
  [[nodiscard]] bool is_quadratic() const noexcept;
  /// Stages that the KKT systems are factorised along, once one was; 0: there are none.
  [[nodiscard]] std::size_t stages() const noexcept { return stages_ ? stages_->stages() : 0; }
  /// What is not finite at a point: a value, or where all are finite a derivative.
  struct Fault {
    int row = -2;  ///< -1: the cost; -2: nothing is.
    bool derivative = false;
  };
  [[nodiscard]] Fault find_fault(const Eigen::VectorXd& w);
  /// What has another slope before a point than behind it, as |y| has at zero: from a millionth to
  /// a hundredth away, along the direction in which all variables grow.
  /// @return the row, -1 for the cost, -2 where nothing has.
  [[nodiscard]] int find_kink(const Eigen::VectorXd& w);

 private:
  struct Compiled {
    expression::LaneTape values, derivatives;
    expression::Lagrangian functions;
    std::vector<double> value_work, derivative_work;
    std::vector<int> jacobian_places;  // of each term's entries: in a_, or a variable of the cost
    std::vector<int> hessian_places;   // of each term's entries, in h_
  };

  void build_pattern();
  [[nodiscard]] bool fixes_the_same(const FlatProblem& flat) const;
  void refresh();
  void gather(const Shape& shape, const expression::LaneTape& tape, std::size_t first,
              std::size_t count, const double* w, double* work) const;
  void analyze();

  FlatProblem flat_;
  int n_ = 0;  // variables without slacks
  int m_ = 0;
  std::vector<Compiled> compiled_;
  std::vector<int> a_start_, a_columns_;  // of c by x, by rows
  std::vector<double> a_linear_, a_;
  std::vector<int> linear_places_;       // of the flat rows' entries
  std::vector<int> h_rows_, h_columns_;  // lower triangle
  std::vector<double> h_;
  std::vector<int> slack_;  // of a row in w, or -1
  std::vector<double> row_scale_;
  double objective_scale_ = 1.0;
  SparseLdlt ldlt_;
  std::unique_ptr<StageFactor> stages_;  // where there are stages
  bool analyzed_ = false;
  bool values_moved_ = false;  // whether the stages have the newest numbers
  std::vector<unsigned char> a_is_linear_;
  std::vector<double> along_;
  std::vector<double> kkt_, rhs_, slack_diagonal_, row_diagonal_;
  std::vector<unsigned char> fixed_;
};

}  // namespace flyball::optimization::detail
