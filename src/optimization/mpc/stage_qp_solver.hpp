#pragma once

#include <vector>

#include <Eigen/Core>

#include "optimization/mpc/stage_qp.hpp"

namespace flyball::optimization::detail {

/// What a program over stages has; all of it is decided before memory is asked for.
struct StageQpSizes {
  int horizon = 0;
  int states = 0;
  int inputs = 0;
  bool stays = true;        ///< Whether H and [A B] are the same at all stages and for all solves.
  bool bounds_stay = true;  ///< Whether the bounds are the same at all stages.
  bool has_rates = false;   ///< The last `inputs` states are then the input before.
  Eigen::VectorXd sigma{};  ///< Of each state's bounds; empty: states have none.
  Eigen::VectorXd rho{};    ///< Likewise.
};

/// A quadratic program over stages with its memory, which is asked for when it is made.
class StageQpSolver {
 public:
  /// Most states and inputs together.
  static constexpr int largest = 200;

  explicit StageQpSolver(const StageQpSizes& sizes);
  StageQpSolver(const StageQpSolver& other);
  StageQpSolver(StageQpSolver&&) noexcept = default;
  StageQpSolver& operator=(const StageQpSolver& other);
  StageQpSolver& operator=(StageQpSolver&&) noexcept = default;
  ~StageQpSolver() = default;

  /// The data, to be written in place; a stage's stands at `k` times its stride. @param k  Of what
  /// stays only stage 0 is there.
  ///@{
  [[nodiscard]] double* H(int k) noexcept { return H_.data() + k * qp_.H_stride; }
  [[nodiscard]] double* H_end() noexcept { return H_N_.data(); }
  [[nodiscard]] double* AB(int k) noexcept { return AB_.data() + k * qp_.AB_stride; }
  [[nodiscard]] double* h(int k) noexcept { return h_.data() + k * width_; }
  [[nodiscard]] double* b(int k) noexcept { return b_.data() + k * width_; }
  [[nodiscard]] double* lower(int k) noexcept { return lower_.data() + k * qp_.bound_stride; }
  [[nodiscard]] double* upper(int k) noexcept { return upper_.data() + k * qp_.bound_stride; }
  /// Of states at stage k >= 1.
  [[nodiscard]] double* x_lower(int k) noexcept { return x_lower_.data() + (k - 1) * qp_.x_stride; }
  [[nodiscard]] double* x_upper(int k) noexcept { return x_upper_.data() + (k - 1) * qp_.x_stride; }
  [[nodiscard]] double* rate_lower() noexcept { return rate_lower_.data(); }
  [[nodiscard]] double* rate_upper() noexcept { return rate_upper_.data(); }
  [[nodiscard]] double* x_0() noexcept { return x_0_.data(); }
  ///@}

  /// Which bounds are finite is decided now. @param tolerance_scale  Of multipliers: the size of a
  /// gradient. @return false where the cost is not convex, or is not bounded from below.
  [[nodiscard]] bool prepare(double tolerance_scale);
  /// [A B] of a stage was written: its transpose follows.
  void transpose(int k) noexcept;
  /// After h or b were written, where matrices stay. @param has_affine  Whether any b is not zero.
  void refresh(bool has_affine) noexcept;

  /// The active set starts empty, or as the last solution's one stage on.
  ///@{
  void forget() noexcept;
  void shift() noexcept;
  ///@}
  QpEnd solve() noexcept;

  [[nodiscard]] const double* z(int k) const noexcept { return z_.data() + k * width_; }
  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] const StageQp& qp() const noexcept { return qp_; }
  [[nodiscard]] StageQp& qp() noexcept { return qp_; }

 private:
  void bind() noexcept;

  StageQp qp_;
  int width_ = 0;
  bool stays_ = true;
  std::vector<double> H_, H_N_, AB_, AB_t_, h_, b_, x_0_, lower_, upper_, rate_lower_, rate_upper_;
  std::vector<double> x_lower_, x_upper_, sigma_, rho_;
  std::vector<double> P_free_, L_free_, pivots_free_, p_free_, g_free_;
  std::vector<double> P_, L_, pivots_, p_, g_, z_, mu_, scratch_;
  std::vector<signed char> active_, none_active_;
  std::vector<int> side_at_, side_minus_, side_state_;
  std::vector<double> side_sign_, side_, weights_, rate_weights_, gradients_, other_z_;
  std::vector<const double*> side_bound_;
};

}  // namespace flyball::optimization::detail
