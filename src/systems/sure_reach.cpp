#include <algorithm>
#include <cmath>
#include <limits>

#include "core/constants.hpp"
#include "math/dense/dense.hpp"
#include "systems/sure_reach.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;

bool alike(double a, double b, double tolerance) {
  return std::abs(a / 2.0 - b / 2.0) <= tolerance * std::max(std::abs(a / 2.0), std::abs(b / 2.0));
}

/// Of [A - λI, B]: which entries are not zero, for a λ that is none of the diagonal's or one of it.
class Forcing {
 public:
  Forcing(const MatrixRef& A, const MatrixRef& B) : n_(A.rows()), entries_(n_, n_ + B.cols()) {
    entries_.leftCols(n_) = A.array() != 0.0;
    entries_.rightCols(B.cols()) = B.array() != 0.0;
    entries_.leftCols(n_).matrix().diagonal().setConstant(true);
  }

  /// @param unsure  The columns whose diagonal entry may be zero or not.
  [[nodiscard]] bool all(const std::vector<bool>& unsure) const {
    Eigen::VectorX<Index> unknown(entries_.cols());
    std::vector<Index> ready;
    for (Index j = 0; j < entries_.cols(); ++j) {
      unknown(j) = entries_.col(j).count();
      if (unknown(j) == 1) {
        ready.push_back(j);
      }
    }
    std::vector<bool> zero(static_cast<std::size_t>(n_), false);
    Index done = 0;
    while (!ready.empty()) {
      const Index column = ready.back();
      ready.pop_back();
      Index row = 0;
      while (row < n_ && !(entries_(row, column) && !zero[static_cast<std::size_t>(row)])) {
        ++row;
      }
      if (row == n_ || (row == column && unsure[static_cast<std::size_t>(row)])) {
        continue;
      }
      zero[static_cast<std::size_t>(row)] = true;
      ++done;
      for (Index j = 0; j < entries_.cols(); ++j) {
        if (entries_(row, j) && --unknown(j) == 1) {
          ready.push_back(j);
        }
      }
    }
    return done == n_;
  }

 private:
  Index n_;
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> entries_;
};

/// The states in groups that act on each other, however indirectly.
std::vector<std::vector<Index>> parts_of(const MatrixRef& A) {
  const Index n = A.rows();
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> path = A.array() != 0.0;
  for (Index k = 0; k < n; ++k) {
    for (Index j = 0; j < n; ++j) {
      if (path(k, j)) {
        path.col(j) = path.col(j) || path.col(k);
      }
    }
  }
  std::vector<std::vector<Index>> parts;
  std::vector<bool> taken(static_cast<std::size_t>(n), false);
  for (Index i = 0; i < n; ++i) {
    if (taken[static_cast<std::size_t>(i)]) {
      continue;
    }
    std::vector<Index>& part = parts.emplace_back();
    for (Index j = i; j < n; ++j) {
      if (j == i || (path(i, j) && path(j, i))) {
        part.push_back(j);
        taken[static_cast<std::size_t>(j)] = true;
      }
    }
  }
  return parts;
}

bool full_rank_at(Complex lambda, const MatrixRef& A, const MatrixRef& B) {
  constexpr double clear = 1e-7;
  const Index n = A.rows();
  Eigen::MatrixXcd pencil(n, n + B.cols());
  pencil << A.cast<Complex>(), B.cast<Complex>();
  for (Index i = 0; i < n; ++i) {
    const Complex left = A(i, i) - lambda;
    const double known = 1e4 * epsilon * std::max(std::abs(A(i, i)), std::abs(lambda));
    pencil(i, i) = std::abs(left) <= known ? Complex(0.0) : left;
  }
  for (int pass = 0; pass < 6; ++pass) {
    for (Index i = 0; i < n; ++i) {
      const double size = pencil.row(i).cwiseAbs().maxCoeff();
      pencil.row(i) /= size > 0.0 ? size : 1.0;
    }
    for (Index j = 0; j < pencil.cols(); ++j) {
      const double size = pencil.col(j).cwiseAbs().maxCoeff();
      pencil.col(j) /= size > 0.0 ? size : 1.0;
    }
  }
  return singular_values_of_complex(pencil)(n - 1) > clear;
}

}  // namespace

std::vector<Index> states_on_paths(const MatrixRef& A, const MatrixRef& B) {
  const Index n = A.rows();
  std::vector<bool> seen(static_cast<std::size_t>(n), false);
  std::vector<Index> queue;
  const auto visit = [&](Index i) {
    if (!seen[static_cast<std::size_t>(i)]) {
      seen[static_cast<std::size_t>(i)] = true;
      queue.push_back(i);
    }
  };
  for (Index j = 0; j < B.cols(); ++j) {
    for (Index i = 0; i < n; ++i) {
      if (B(i, j) != 0.0) {
        visit(i);
      }
    }
  }
  for (std::size_t k = 0; k < queue.size(); ++k) {
    for (Index i = 0; i < n; ++i) {
      if (A(i, queue[k]) != 0.0) {
        visit(i);
      }
    }
  }
  std::sort(queue.begin(), queue.end());
  return queue;
}

bool surely_reached(const MatrixRef& A, const MatrixRef& B, double tolerance) {
  const Index n = A.rows();
  const Forcing forcing(A, B);
  std::vector<bool> unsure(static_cast<std::size_t>(n), false);
  if (!forcing.all(unsure)) {
    return false;
  }
  for (Index k = 0; k < n; ++k) {
    for (Index i = 0; i < n; ++i) {
      unsure[static_cast<std::size_t>(i)] = alike(A(i, i), A(k, k), tolerance);
    }
    if (!forcing.all(unsure)) {
      return false;
    }
  }
  return true;
}

bool reached_at_every_speed(const MatrixRef& A, const MatrixRef& B) {
  constexpr double apart = 1e6;
  constexpr Index most = 30;
  if (A.rows() > most) {
    return false;
  }
  Eigen::VectorXcd modes(0);
  double fastest = 0.0;
  double slowest = std::numeric_limits<double>::infinity();
  for (const std::vector<Index>& part : parts_of(A)) {
    MatrixXd own = A(part, part);
    const double size = own.cwiseAbs().maxCoeff();
    if (size > 0.0) {
      own /= size;
      fastest = std::max(fastest, size);
      slowest = std::min(slowest, size);
    }
    const Eigen::VectorXcd values = size * eigenvalues_of(own);
    modes.conservativeResize(modes.size() + values.size());
    modes.tail(values.size()) = values;
  }
  if (!(fastest > apart * slowest) || !modes.allFinite()) {
    return false;
  }
  return std::all_of(modes.begin(), modes.end(), [&](Complex lambda) {
    return lambda.imag() < 0.0 || full_rank_at(lambda, A, B);
  });
}

}  // namespace flyball::detail
