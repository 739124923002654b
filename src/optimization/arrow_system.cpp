#include <algorithm>
#include <cmath>
#include <limits>

#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "optimization/arrow_system.hpp"

namespace flyball::optimization {

namespace {

template <class Visit>
void each_block(const ArrowSystem& system, const Visit& visit) {
  for (const ArrowBlock& block : system.blocks) {
    visit(block);
  }
  visit(system.root);
}

/// The block's columns of J, and its parameters' values.
std::vector<Index> columns_of(const ArrowBlock& block) {
  std::vector<Index> all = block.local;
  all.insert(all.end(), block.shared.begin(), block.shared.end());
  return all;
}

VectorXd solve_upper(const MatrixXd& R, const VectorXd& b) {
  VectorXd x = b;
  for (Index i = R.rows() - 1; i >= 0; --i) {
    x(i) = (x(i) - R.row(i).tail(R.cols() - 1 - i).dot(x.tail(R.cols() - 1 - i))) / R(i, i);
  }
  return x;
}

/// The columns of free parameters, r + J d of the others behind them, and the damping's rows below.
struct Reduced {
  std::vector<Index> columns{};  ///< Places among all parameters.
  Index local = 0;               ///< How many of them are the block's own.
  MatrixXd M{};
};
Reduced reduce(const ArrowBlock& block, const std::vector<char>& free, const VectorXd& d,
               double damping, const VectorXd& D, bool damp_shared) {
  Reduced made;
  const std::vector<Index> all = columns_of(block);
  std::vector<Index> places;
  const Index rows = block.T.rows();
  VectorXd r = block.T.rightCols(1);
  for (std::size_t c = 0; c < all.size(); ++c) {
    const auto column = static_cast<Index>(c);
    if (free[static_cast<std::size_t>(all[c])] != 0) {
      places.push_back(column);
      made.columns.push_back(all[c]);
      made.local += c < block.local.size() ? 1 : 0;
    } else if (d(all[c]) != 0.0) {
      r += block.T.col(column) * d(all[c]);
    }
  }
  const auto count = static_cast<Index>(places.size());
  const Index damped = damp_shared ? count : made.local;
  made.M = MatrixXd::Zero(rows + damped, count + 1);
  for (Index j = 0; j < count; ++j) {
    made.M.col(j).head(rows) = block.T.col(places[static_cast<std::size_t>(j)]);
  }
  made.M.rightCols(1).topRows(rows) = r;
  for (Index j = 0; j < damped; ++j) {
    made.M(rows + j, j) = std::sqrt(damping) * D(made.columns[static_cast<std::size_t>(j)]);
  }
  return made;
}

MatrixXd stacked(const MatrixXd& top, const MatrixXd& bottom) {
  MatrixXd both(top.rows() + bottom.rows(), top.cols());
  both << top, bottom;
  return both;
}

}  // namespace

void summarize(ArrowSystem& system) {
  system.column_norms = VectorXd::Zero(system.parameters);
  system.half_gradient = VectorXd::Zero(system.parameters);
  system.square = 0.0;
  each_block(system, [&](const ArrowBlock& block) {
    const std::vector<Index> all = columns_of(block);
    const VectorXd r = block.T.rightCols(1);
    system.square += r.squaredNorm();
    for (std::size_t c = 0; c < all.size(); ++c) {
      const auto column = block.T.col(static_cast<Index>(c));
      system.column_norms(all[c]) = std::hypot(system.column_norms(all[c]), column.norm());
      system.half_gradient(all[c]) += column.dot(r);
    }
  });
}

ArrowProducts products(const ArrowSystem& system, const VectorXd& d) {
  ArrowProducts made{system.half_gradient, 0.0};
  each_block(system, [&](const ArrowBlock& block) {
    const std::vector<Index> all = columns_of(block);
    VectorXd moved = VectorXd::Zero(block.T.rows());
    for (std::size_t c = 0; c < all.size(); ++c) {
      moved += block.T.col(static_cast<Index>(c)) * d(all[c]);
    }
    made.moved += moved.squaredNorm();
    for (std::size_t c = 0; c < all.size(); ++c) {
      made.half_gradient(all[c]) += block.T.col(static_cast<Index>(c)).dot(moved);
    }
  });
  return made;
}

void ArrowFactors::follow(const VectorXd& v, VectorXd& d) const {
  for (const Local& block : blocks) {
    VectorXd sum = VectorXd::Zero(block.R_ll.rows());
    for (std::size_t j = 0; j < block.shared.size(); ++j) {
      sum -= block.R_ls.col(static_cast<Index>(j)) * v(block.shared[j]);
    }
    const VectorXd own = solve_upper(block.R_ll, sum);
    for (std::size_t i = 0; i < block.local.size(); ++i) {
      d(block.local[i]) = own(static_cast<Index>(i));
    }
  }
}

ArrowFactors factor(const ArrowSystem& system, const std::vector<char>& free, const VectorXd& d,
                    double damping, const VectorXd& D) {
  ArrowFactors made;
  Reduced root = reduce(system.root, free, d, damping, D, true);
  made.shared = root.columns;
  std::vector<Index> place(static_cast<std::size_t>(system.parameters), -1);
  for (std::size_t j = 0; j < made.shared.size(); ++j) {
    place[static_cast<std::size_t>(made.shared[j])] = static_cast<Index>(j);
  }
  const auto count = static_cast<Index>(made.shared.size());
  MatrixXd pending(0, count + 1);  // rows of the blocks, reduced before they become many
  for (const ArrowBlock& block : system.blocks) {
    Reduced own = reduce(block, free, d, damping, D, false);
    const MatrixXd R = detail::triangle_of(own.M);
    ArrowFactors::Local local;
    local.local.assign(own.columns.begin(), own.columns.begin() + own.local);
    for (auto c = static_cast<std::size_t>(own.local); c < own.columns.size(); ++c) {
      local.shared.push_back(place[static_cast<std::size_t>(own.columns[c])]);
    }
    const auto shared = static_cast<Index>(local.shared.size());
    local.R_ll = R.topLeftCorner(own.local, own.local);
    local.R_ls = R.block(0, own.local, own.local, shared);
    local.q = R.rightCols(1).topRows(own.local);
    const Index rest = R.rows() - own.local;
    MatrixXd rows = MatrixXd::Zero(rest, count + 1);
    for (Index j = 0; j < shared; ++j) {
      rows.col(local.shared[static_cast<std::size_t>(j)]) = R.col(own.local + j).bottomRows(rest);
    }
    rows.rightCols(1) = R.rightCols(1).bottomRows(rest);
    pending = stacked(pending, rows);
    if (pending.rows() > 8 * (count + 1)) {
      pending = detail::triangle_of(pending);
    }
    made.blocks.push_back(std::move(local));
  }
  const MatrixXd R = detail::triangle_of(stacked(root.M, pending));
  made.R = R.topLeftCorner(count, count);
  made.q = R.rightCols(1).topRows(count);
  return made;
}

namespace {

/// The unconstrained minimiser over the free parameters; the others stay as they are in `d`.
VectorXd solve_free(const ArrowSystem& system, const std::vector<char>& free, const VectorXd& d,
                    double damping, const VectorXd& D) {
  const ArrowFactors factors = factor(system, free, d, damping, D);
  VectorXd z = d;
  const VectorXd shared = solve_upper(factors.R, -factors.q);
  for (std::size_t j = 0; j < factors.shared.size(); ++j) {
    z(factors.shared[j]) = shared(static_cast<Index>(j));
  }
  for (const ArrowFactors::Local& block : factors.blocks) {
    VectorXd right = -block.q;
    for (std::size_t j = 0; j < block.shared.size(); ++j) {
      right -= block.R_ls.col(static_cast<Index>(j)) * shared(block.shared[j]);
    }
    const VectorXd own = solve_upper(block.R_ll, right);
    for (std::size_t i = 0; i < block.local.size(); ++i) {
      z(block.local[i]) = own(static_cast<Index>(i));
    }
  }
  return z;
}

}  // namespace

BoxStep box_step(const ArrowSystem& system, const VectorXd& low, const VectorXd& high,
                 double damping, const VectorXd& D) {
  const Index n = system.parameters;
  const VectorXd& g = system.half_gradient;
  std::vector<char> free(static_cast<std::size_t>(n));
  for (Index i = 0; i < n; ++i) {
    free[static_cast<std::size_t>(i)] =
        low(i) < high(i) && !(low(i) == 0.0 && g(i) > 0.0) && !(high(i) == 0.0 && g(i) < 0.0);
  }
  VectorXd d = VectorXd::Zero(n);
  const double noise = 1e-13 * std::sqrt(system.square);
  // Each pass lowers the model, so that where the cap ends it, the step is one of descent.
  for (Index pass = 0; pass < 3 * n + 10; ++pass) {
    const VectorXd z = solve_free(system, free, d, damping, D);
    if (!z.allFinite()) {
      break;
    }
    double share = 1.0;
    for (Index i = 0; i < n; ++i) {
      if (free[static_cast<std::size_t>(i)] != 0 && (z(i) < low(i) || z(i) > high(i))) {
        const double bound = z(i) < low(i) ? low(i) : high(i);
        share = std::min(share, (bound - d(i)) / (z(i) - d(i)));
      }
    }
    const VectorXd from = d;
    d += share * (z - d);
    bool blocked = false;
    for (Index i = 0; i < n; ++i) {
      if (free[static_cast<std::size_t>(i)] == 0 || (z(i) >= low(i) && z(i) <= high(i))) {
        continue;
      }
      const double bound = z(i) < low(i) ? low(i) : high(i);
      if ((bound - from(i)) / (z(i) - from(i)) <= share) {
        d(i) = bound;
        free[static_cast<std::size_t>(i)] = 0;
        blocked = true;
      }
    }
    if (blocked) {
      continue;
    }
    // Of those at a bound, the one that gains most by leaving it.
    const VectorXd w = products(system, d).half_gradient + damping * D.cwiseAbs2().cwiseProduct(d);
    Index leaving = -1;
    double most = noise;
    for (Index i = 0; i < n; ++i) {
      if (free[static_cast<std::size_t>(i)] != 0 || !(low(i) < high(i))) {
        continue;
      }
      const double gain = (d(i) == low(i) ? -w(i) : w(i)) / D(i);
      if (gain > most) {
        most = gain;
        leaving = i;
      }
    }
    if (leaving < 0) {
      break;
    }
    free[static_cast<std::size_t>(leaving)] = 1;
  }
  const ArrowProducts at = products(system, d);
  const double decrease = -2.0 * g.dot(d) - at.moved;
  return {d, decrease, decrease - damping * D.cwiseProduct(d).squaredNorm()};
}

namespace {

/// The same space by vectors of which each leaves alone what the others are told by: what people
/// can read of it. The largest entry of each is 1.
MatrixXd few_at_a_time(const std::vector<VectorXd>& vectors, Index n) {
  MatrixXd N(n, static_cast<Index>(vectors.size()));
  for (Index j = 0; j < N.cols(); ++j) {
    N.col(j) = vectors[static_cast<std::size_t>(j)];
  }
  for (Index j = 0; j < N.cols(); ++j) {
    Index pivot = 0;
    N.col(j).cwiseAbs().maxCoeff(&pivot);
    N.col(j) /= N(pivot, j);
    for (Index other = 0; other < N.cols(); ++other) {
      if (other != j) {
        N.col(other) -= N(pivot, other) * N.col(j);
      }
    }
  }
  for (Index j = 0; j < N.cols(); ++j) {
    Index largest = 0;
    const double size = N.col(j).cwiseAbs().maxCoeff(&largest);
    N.col(j) = (N.col(j).array().abs() > 1e-9 * size).select(N.col(j) / N(largest, j), 0.0);
  }
  return N;
}

}  // namespace

ArrowRank rank_of(const ArrowSystem& system, const std::vector<char>& free, double tolerance) {
  ArrowRank made;
  const Index n = system.parameters;
  const VectorXd D = (system.column_norms.array() > 0.0).select(system.column_norms, 1.0);
  constexpr double damping = 1e-24;  // far below any tolerance
  const ArrowFactors factors = factor(system, free, VectorXd::Zero(n), damping, D);
  double largest = 0.0;
  double smallest = std::numeric_limits<double>::infinity();
  std::vector<VectorXd> undetermined;
  const auto look = [&](MatrixXd R, const std::vector<Index>& places, bool shared) {
    if (R.rows() == 0) {
      return;
    }
    for (std::size_t j = 0; j < places.size(); ++j) {
      R.col(static_cast<Index>(j)) /= D(places[j]);
    }
    const detail::SingularValues svd = detail::svd_of(R);
    largest = std::max(largest, svd.values(0));
    smallest = std::min(smallest, svd.values(svd.values.size() - 1));
    for (Index i = 0; i < svd.values.size(); ++i) {
      if (svd.values(i) > tolerance) {
        ++made.rank;
        continue;
      }
      VectorXd d = VectorXd::Zero(n);
      VectorXd v = svd.V.col(i);
      for (std::size_t j = 0; j < places.size(); ++j) {
        v(static_cast<Index>(j)) /= D(places[j]);
        d(places[j]) = v(static_cast<Index>(j));
      }
      if (shared) {
        factors.follow(v, d);
      }
      undetermined.emplace_back(d.cwiseProduct(D));
    }
  };
  look(factors.R, factors.shared, true);
  for (const ArrowFactors::Local& block : factors.blocks) {
    look(block.R_ll, block.local, false);
  }
  made.undetermined = few_at_a_time(undetermined, n);
  made.reciprocal_condition = undetermined.empty() && largest > 0.0 ? smallest / largest : 0.0;
  return made;
}

}  // namespace flyball::optimization
