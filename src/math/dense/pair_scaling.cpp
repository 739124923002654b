#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "math/dense/balanced.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/pair_scaling.hpp"
#include "math/dense/spectral_blocks.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double none = -std::numeric_limits<double>::infinity();

MatrixXd logarithms(const MatrixRef& M) {
  return M.unaryExpr([](double x) { return x == 0.0 ? none : std::log2(std::abs(x)); });
}

/// Σ 2^x, by the largest x.
class Sum {
 public:
  void add(double x) {
    if (x == none) {
      return;
    }
    if (x > largest_) {
      sum_ = largest_ == none ? 1.0 : 1.0 + sum_ * std::exp2(largest_ - x);
      largest_ = x;
    } else {
      sum_ += std::exp2(x - largest_);
    }
  }
  [[nodiscard]] double logarithm() const {
    return largest_ == none ? none : largest_ + std::log2(sum_);
  }

 private:
  double largest_ = none;
  double sum_ = 0.0;
};

/// A, B, C by their logarithms, and the units that have been found.
struct Pair {
  MatrixXd a, b, c;
  Eigen::VectorXd e, f, g;

  [[nodiscard]] double A(Index i, Index j) const { return a(i, j) + e(j) - e(i); }
  [[nodiscard]] double B(Index i, Index j) const { return b(i, j) + f(j) - e(i); }
  [[nodiscard]] double C(Index i, Index j) const { return c(i, j) + g(i) + e(j); }

  [[nodiscard]] double size() const {
    Sum all;
    for (Index j = 0; j < a.cols(); ++j) {
      for (Index i = 0; i < a.rows(); ++i) {
        all.add(A(i, j));
      }
    }
    return all.logarithm() == none ? 0.0 : all.logarithm();
  }

  void scale_inputs(double size) {
    for (Index j = 0; j < b.cols(); ++j) {
      const double largest = (b.col(j) - e).maxCoeff();
      f(j) = largest == none ? 0.0 : size - largest;
    }
  }

  void scale_outputs(double size) {
    for (Index i = 0; i < c.rows(); ++i) {
      const double largest = (c.row(i).transpose() + e).maxCoeff();
      g(i) = largest == none ? 0.0 : size - largest;
    }
  }

  /// Each state in the unit in which what first reaches it from the inputs is of the size that
  /// cycles of one or two states show whatever the units are: far units are left behind at once.
  /// One that nothing known reaches takes the unit in which it acts on what is known.
  void start() {
    const Index n = a.rows();
    double cycle = none;
    for (Index j = 0; j < n; ++j) {
      for (Index i = 0; i <= j; ++i) {
        cycle = std::max(cycle, 0.5 * (a(i, j) + a(j, i)));
      }
    }
    cycle = cycle == none ? 0.0 : cycle;
    std::vector<bool> seen(static_cast<std::size_t>(n), false);
    std::vector<Index> queue;
    const auto visit = [&](Index i, double unit) {
      if (!seen[static_cast<std::size_t>(i)]) {
        seen[static_cast<std::size_t>(i)] = true;
        e(i) = unit - cycle;
        queue.push_back(i);
      }
    };
    const auto spread = [&](std::size_t from) {
      for (std::size_t k = from; k < queue.size(); ++k) {
        const Index j = queue[k];
        for (Index i = 0; i < n; ++i) {
          if (a(i, j) != none) {
            visit(i, a(i, j) + e(j));
          }
        }
      }
    };
    for (Index j = 0; j < b.cols(); ++j) {
      double shift = none;  // The unit of an input that moves a known state.
      for (Index i = 0; i < n && shift == none; ++i) {
        if (b(i, j) != none && seen[static_cast<std::size_t>(i)]) {
          shift = e(i) + cycle - b(i, j);
        }
      }
      const std::size_t from = queue.size();
      for (Index i = 0; i < n; ++i) {
        if (b(i, j) != none) {
          visit(i, b(i, j) + (shift == none ? 0.0 : shift));
        }
      }
      spread(from);
    }
    const auto spread_back = [&](std::size_t from) {
      for (std::size_t k = from; k < queue.size(); ++k) {
        const Index j = queue[k];
        for (Index i = 0; i < n; ++i) {
          if (a(j, i) != none && !seen[static_cast<std::size_t>(i)]) {
            const std::size_t found = queue.size();
            visit(i, e(j) - a(j, i) + 2.0 * cycle);
            spread(found);
          }
        }
      }
    };
    spread_back(0);
    for (Index i = 0; i < n; ++i) {
      const std::size_t from = queue.size();
      visit(i, cycle);
      spread(from);
      spread_back(from);
    }
  }

  /// The unit of state i moved by whole powers of two; whether it was. By the largest entries: if
  /// sums of several had to be of one size, each sweep would take the unit of a state that only
  /// inputs reach further from those of the others.
  bool balance(Index i, double size) {
    double rows = none;
    double columns = none;
    for (Index j = 0; j < a.cols(); ++j) {
      if (j != i) {
        rows = std::max(rows, A(i, j));
        columns = std::max(columns, A(j, i));
      }
    }
    for (Index j = 0; j < b.cols(); ++j) {
      rows = std::max(rows, B(i, j));
    }
    for (Index j = 0; j < c.rows(); ++j) {
      columns = std::max(columns, C(j, i));
    }
    if (rows == none && columns == none) {
      return false;
    }
    const double step = std::trunc(rows == none      ? size - columns
                                   : columns == none ? rows - size
                                                     : 0.5 * (rows - columns));
    e(i) += step;
    return step != 0.0;
  }
};

int whole(double exponent) {
  return static_cast<int>(std::lround(exponent));
}

}  // namespace

double cycle_mean_of(const MatrixRef& A) {
  const Index n = A.rows();
  const MatrixXd a = logarithms(A);
  // walks(i, k): the most that k steps which end at i can bring together.
  MatrixXd walks = MatrixXd::Constant(n, n + 1, none);
  walks.col(0).setZero();
  for (Index k = 0; k < n; ++k) {
    for (Index j = 0; j < n; ++j) {
      if (walks(j, k) == none) {
        continue;
      }
      for (Index i = 0; i < n; ++i) {
        walks(i, k + 1) = std::max(walks(i, k + 1), walks(j, k) + a(i, j));
      }
    }
  }
  double most = none;
  for (Index i = 0; i < n; ++i) {
    if (walks(i, n) == none) {
      continue;
    }
    double least = std::numeric_limits<double>::infinity();
    for (Index k = 0; k < n; ++k) {
      if (walks(i, k) != none) {
        least = std::min(least, (walks(i, n) - walks(i, k)) / static_cast<double>(n - k));
      }
    }
    most = std::max(most, least);
  }
  return most;
}

void balance_parts(const MatrixRef& A, Eigen::VectorXi& states) {
  for (const std::vector<Index>& part : parts_of(A)) {
    if (part.size() < 2) {
      continue;
    }
    const Eigen::VectorXi own =
        balance_of(MatrixXd(A(part, part))).unaryExpr([](double d) { return std::ilogb(d); });
    const double apart = (states(part) - own).cast<double>().mean();
    states(part) = own.array() + static_cast<int>(std::lround(apart));
  }
}

PairScaling pair_scaling_of(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C) {
  constexpr int sweeps = 200;
  const Index n = A.rows();
  Pair pair{logarithms(A),
            logarithms(B),
            logarithms(C),
            Eigen::VectorXd::Zero(n),
            Eigen::VectorXd::Zero(B.cols()),
            Eigen::VectorXd::Zero(C.rows())};
  pair.start();
  pair.e = pair.e.array().round();
  // It stays as it is: if it followed the entries that are brought to it, all would run away.
  const double cycle = cycle_mean_of(A);
  const double size = cycle == none ? pair.size() : cycle;
  // Steps of all states together only change the inputs' and the outputs' units, whether in one
  // sweep or in turns of several: then units are those of a sweep before, but for one factor
  // (Brent's search).
  Eigen::VectorXd before = pair.e;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    pair.scale_inputs(size);
    pair.scale_outputs(size);
    bool changed = false;
    for (Index k = 0; k < n; ++k) {
      changed = pair.balance(k, size) || changed;
    }
    if (!changed || ((pair.e - before).array() == pair.e(0) - before(0)).all()) {
      break;
    }
    if ((sweep & (sweep + 1)) == 0) {
      before = pair.e;
    }
  }
  if (!is_far(A)) {
    Eigen::VectorXi states = pair.e.unaryExpr(&whole);
    balance_parts(A, states);
    pair.e = states.cast<double>();
    pair.scale_inputs(size);
    pair.scale_outputs(size);
  }
  PairScaling scaling{Eigen::VectorXi(n), Eigen::VectorXi::Zero(B.cols()), whole(pair.size()),
                      Eigen::VectorXi::Zero(C.rows())};
  for (Index i = 0; i < n; ++i) {
    scaling.states(i) = whole(pair.e(i));
  }
  // B' gets the norm of A', each of its columns an equal share.
  const double norm = scaled_A(A, scaling).norm();
  const double share =
      (norm > 0.0 ? norm : 1.0) / std::sqrt(std::max(1.0, static_cast<double>(B.cols())));
  for (Index j = 0; j < B.cols(); ++j) {
    scaling.inputs(j) = whole(pair.f(j) - size);
  }
  const Eigen::VectorXd columns = scaled_B(B, scaling).colwise().norm();
  for (Index j = 0; j < B.cols(); ++j) {
    scaling.inputs(j) += columns(j) > 0.0 ? whole(std::log2(share / columns(j))) : 0;
  }
  for (Index i = 0; i < C.rows(); ++i) {
    scaling.outputs(i) = whole(pair.g(i) - size);
  }
  return scaling;
}

PairScaling pair_scaling_of(const MatrixRef& A, const MatrixRef& B) {
  return pair_scaling_of(A, B, MatrixXd(0, A.cols()));
}

MatrixXd scaled_A(const MatrixRef& A, const PairScaling& scaling) {
  return MatrixXd::NullaryExpr(A.rows(), A.cols(), [&](Index i, Index j) {
    return std::ldexp(A(i, j), scaling.states(j) - scaling.states(i) - scaling.time);
  });
}

MatrixXd scaled_B(const MatrixRef& B, const PairScaling& scaling) {
  return MatrixXd::NullaryExpr(B.rows(), B.cols(), [&](Index i, Index j) {
    return std::ldexp(B(i, j), scaling.inputs(j) - scaling.states(i));
  });
}

MatrixXd scaled_C(const MatrixRef& C, const PairScaling& scaling) {
  return MatrixXd::NullaryExpr(C.rows(), C.cols(), [&](Index i, Index j) {
    return std::ldexp(C(i, j), scaling.outputs(i) + scaling.states(j));
  });
}

}  // namespace flyball::detail
