#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "math/dense/balanced.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/dense/spectral_blocks.hpp"
#include "math/extended/double_double.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Indices = std::vector<Index>;

constexpr double far_apart = 0x1p20;

double largest(const MatrixXd& M) {
  return M.size() == 0 ? 0.0 : M.cwiseAbs().maxCoeff();
}

/// Whether entries of A differ so much that its eigenvalues may.
bool is_spread(const MatrixRef& A) {
  double least = largest(A);
  const double bound = least / far_apart;
  for (Index j = 0; j < A.cols(); ++j) {
    for (Index i = 0; i < A.rows(); ++i) {
      if (const double size = std::abs(A(i, j)); size > 0.0) {
        least = std::min(least, size);
      }
    }
  }
  return A.rows() > 1 && A.allFinite() && least < bound;
}

/// The states that `from` drives, itself among them; with `back` those that drive it.
std::vector<bool> reached(const MatrixRef& A, Index from, bool back) {
  std::vector<bool> seen(static_cast<std::size_t>(A.rows()), false);
  Indices queue{from};
  seen[static_cast<std::size_t>(from)] = true;
  while (!queue.empty()) {
    const Index j = queue.back();
    queue.pop_back();
    for (Index i = 0; i < A.rows(); ++i) {
      if (!seen[static_cast<std::size_t>(i)] && (back ? A(j, i) : A(i, j)) != 0.0) {
        seen[static_cast<std::size_t>(i)] = true;
        queue.push_back(i);
      }
    }
  }
  return seen;
}

}  // namespace

std::vector<Indices> parts_of(const MatrixRef& A) {
  std::vector<Indices> parts;
  std::vector<bool> done(static_cast<std::size_t>(A.rows()), false);
  for (Index first = 0; first < A.rows(); ++first) {
    if (done[static_cast<std::size_t>(first)]) {
      continue;
    }
    const std::vector<bool> driven = reached(A, first, false);
    const std::vector<bool> driving = reached(A, first, true);
    Indices& part = parts.emplace_back();
    for (Index i = first; i < A.rows(); ++i) {
      if (driven[static_cast<std::size_t>(i)] && driving[static_cast<std::size_t>(i)]) {
        part.push_back(i);
        done[static_cast<std::size_t>(i)] = true;
      }
    }
  }
  return parts;
}

namespace {

struct Decoupled {
  MatrixXd fast;
  MatrixXd slow;
};

std::optional<Decoupled> decoupled(const MatrixXd& M) {
  constexpr int most_steps = 40;
  constexpr double enough = 1e-30;
  const Index n = M.rows();
  const Eigen::VectorXd sizes =
      M.cwiseAbs().rowwise().maxCoeff().cwiseMax(M.cwiseAbs().colwise().maxCoeff().transpose());
  Indices order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), Index{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](Index a, Index b) { return sizes(a) > sizes(b); });
  Index count = 0;
  double gap = far_apart;
  for (Index k = 1; k < n; ++k) {
    const double ratio =
        sizes(order[static_cast<std::size_t>(k - 1)]) / sizes(order[static_cast<std::size_t>(k)]);
    if (ratio > gap) {
      gap = ratio;
      count = k;
    }
  }
  if (count == 0) {
    return std::nullopt;
  }
  const DoubleDoubleMatrix all(MatrixXd(M(order, order)));
  const Index rest = n - count;
  const DoubleDoubleMatrix F = all.block(0, 0, count, count);
  const DoubleDoubleMatrix across = all.block(0, count, count, rest);
  const DoubleDoubleMatrix back = all.block(count, 0, rest, count);
  const DoubleDoubleMatrix S = all.block(count, count, rest, rest);
  DoubleDoubleMatrix X = DoubleDoubleMatrix::zero(rest, count);
  for (int step = 0; step < most_steps; ++step) {
    const DoubleDoubleMatrix slow = add_product(S, -1.0, X, across);
    const auto next = solve(F.transpose(), add_product(back, 1.0, slow, X).transpose());
    // A large X is of another solution, or of an F that is nearly singular.
    if (!next || !next->all_finite() || !(next->norm() < 1.0)) {
      return std::nullopt;
    }
    const DoubleDoubleMatrix moved = sum(next->transpose(), -1.0, X);
    X = next->transpose();
    if (moved.norm() <= enough * X.norm()) {
      return Decoupled{add_product(F, 1.0, across, X).rounded(),
                       add_product(S, -1.0, X, across).rounded()};
    }
  }
  return std::nullopt;
}

void add_blocks(const MatrixXd& A, int unit, std::vector<MatrixXd>& blocks) {
  if (is_spread(A)) {
    const BalancedMatrix made = balanced_of(A);
    if (const auto parts = decoupled(made.M)) {
      add_blocks(parts->fast, unit + made.unit, blocks);
      add_blocks(parts->slow, unit + made.unit, blocks);
      return;
    }
  }
  blocks.push_back(times_power(A, unit));
}

}  // namespace

std::vector<MatrixXd> spectral_blocks(const MatrixRef& A) {
  std::vector<MatrixXd> blocks;
  if (!is_spread(A)) {
    blocks.emplace_back(A);
    return blocks;
  }
  double most = 0.0;
  double least = std::numeric_limits<double>::infinity();
  const std::vector<Indices> parts = parts_of(A);
  for (const Indices& part : parts) {
    const std::size_t before = blocks.size();
    add_blocks(A(part, part), 0, blocks);
    for (std::size_t k = before; k < blocks.size(); ++k) {
      const BalancedMatrix made = balanced_of(blocks[k]);
      const double size = std::ldexp(largest(made.M), made.unit);
      most = std::max(most, size);
      least = size > 0.0 ? std::min(least, size) : least;
    }
  }
  // What zeros part needs no distance.
  if (parts.size() == 1 && (blocks.size() == 1 || !(most / far_apart > least))) {
    blocks.clear();
    blocks.emplace_back(A);
  }
  return blocks;
}

Eigen::VectorXcd eigenvalues_by_parts_of(const MatrixRef& A) {
  if (A.size() == 0) {
    return Eigen::VectorXcd(0);
  }
  if (!A.allFinite() || (A.array() != 0.0).all()) {
    return eigenvalues_of(A);
  }
  Eigen::VectorXcd values(A.rows());
  Index done = 0;
  for (const Indices& part : parts_of(A)) {
    const auto size = static_cast<Index>(part.size());
    values.segment(done, size) = eigenvalues_of(A(part, part));
    done += size;
  }
  if (!values.allFinite()) {
    values.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return values;
}

}  // namespace flyball::detail
