#pragma once

#include <vector>

#include <Eigen/Core>

/// The linearised problem ‖J d + r‖²: blocks with parameters of their own beside shared ones, each
/// compressed to the triangle of its [J r], which is all that steps and statistics need.
namespace flyball::optimization {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The triangle of a block; its columns are those of its own parameters, of the shared ones that
/// it depends on, and of r.
struct ArrowBlock {
  std::vector<Index> local{};   ///< Places among all parameters.
  std::vector<Index> shared{};  ///< The same.
  MatrixXd T{};
};

/// All blocks, and what stands in no block with parameters of its own.
struct ArrowSystem {
  Index parameters = 0;
  std::vector<ArrowBlock> blocks{};
  ArrowBlock root{};         ///< Without parameters of its own; of every shared one.
  VectorXd column_norms{};   ///< Of J.
  VectorXd half_gradient{};  ///< Jᵀ r
  double square = 0.0;       ///< ‖r‖²
};

/// Fills in what follows from the triangles.
void summarize(ArrowSystem& system);

/// Jᵀ(J d + r) and ‖J d‖².
struct ArrowProducts {
  VectorXd half_gradient{};
  double moved = 0.0;
};
[[nodiscard]] ArrowProducts products(const ArrowSystem& system, const VectorXd& d);

/// Orthogonal factors of the columns of some parameters, the others at given values:
/// R d_shared = -q, and for each block R_ll d_local = -q - R_ls d_shared.
struct ArrowFactors {
  struct Local {
    std::vector<Index> local{};   ///< Places among all parameters.
    std::vector<Index> shared{};  ///< Places among the factors' shared ones.
    MatrixXd R_ll{}, R_ls{};
    VectorXd q{};
  };
  std::vector<Index> shared{};  ///< Places among all parameters.
  MatrixXd R{};
  VectorXd q{};
  std::vector<Local> blocks{};

  /// -R_ll⁻¹ R_ls v of each block, put into its places of `d` (n x 1).
  void follow(const VectorXd& v, VectorXd& d) const;
};
/// @param free  One a parameter. @param d  Values of the others. @param damping  Of ‖D d‖², > 0 so
///              that no factor is singular. @param D  Positive.
[[nodiscard]] ArrowFactors factor(const ArrowSystem& system, const std::vector<char>& free,
                                  const VectorXd& d, double damping, const VectorXd& D);

/// The minimiser of ‖J d + r‖² + damping ‖D d‖² over low ≤ d ≤ high, zero being in there.
struct BoxStep {
  VectorXd d{};
  double decrease = 0.0;         ///< ‖r‖² - ‖J d + r‖²
  double damped_decrease = 0.0;  ///< The same less damping ‖D d‖².
};
/// @param square  ‖r‖², what multipliers are compared with.
[[nodiscard]] BoxStep box_step(const ArrowSystem& system, const VectorXd& low, const VectorXd& high,
                               double damping, const VectorXd& D);

/// Rank and what is not determined, by columns of norm 1.
struct ArrowRank {
  Index rank = 0;
  double reciprocal_condition = 0.0;
  MatrixXd undetermined{};  ///< n x deficiency, each parameter times its column's norm.
};
[[nodiscard]] ArrowRank rank_of(const ArrowSystem& system, const std::vector<char>& free,
                                double tolerance);

}  // namespace flyball::optimization
