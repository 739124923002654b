#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>
#include <utility>
#include <vector>

#include <flyball/identification/identification_error.hpp>
#include <flyball/math/regression/streamed_least_squares.hpp>

#include "core/try.hpp"
#include "identification/subspace_data.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/panels.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// to = M from + to, in columns: what the compiler adds several numbers of at once.
void add_product(const MatrixXd& M, const double* from, double* to) {
  const Index rows = M.rows();
  for (Index l = 0; l < M.cols(); ++l) {
    const double* column = M.col(l).data();
    for (Index i = 0; i < rows; ++i) {
      to[i] += column[i] * from[l];
    }
  }
}

/// The regression's rows one after the other: take(row, target).
template <class Take>
void each_row(const ScaledSignals& record, const InnovationsModel& model, const MatrixXd& W,
              const SubspaceOptions& options, Index size, Take&& take) {
  const Index n = model.system.A.rows();
  const Index m = record.inputs;
  const Index p = record.outputs();
  const Index start = options.initial_state ? n : 0;
  const MatrixXd C_T = (W * model.system.C).transpose();
  const MatrixXd Phi = model.system.A - model.K * model.system.C;
  const MatrixXd Phi_T = Phi.transpose();
  const MatrixXd K_T = model.K.transpose();
  // A sample a column: its numbers lie side by side.
  const MatrixXd u = record.u().transpose();
  const MatrixXd y = record.y().transpose();
  // Columns: z of output r and input j at r m + j; then those of x0, Φᵀ^k Cᵀ; then K y's own x̂.
  const Index pairs = p * m;
  MatrixXd Z = MatrixXd::Zero(n, pairs + p + 1);
  Z.middleCols(pairs, p) = C_T;
  VectorXd row(size);
  VectorXd moved(n);
  // Loops over numbers: the products are too small for a matrix library.
  for (Index k = 0; k < y.cols(); ++k) {
    const double* in = u.col(k).data();
    const double* out = y.col(k).data();
    double* known = Z.col(pairs + p).data();
    for (Index r = 0; r < p; ++r) {
      double* to = row.data();
      to = std::copy_n(Z.col(pairs + r).data(), start, to);
      to = std::copy_n(Z.col(r * m).data(), m * n, to);
      for (Index j = 0; options.feedthrough && j < m; ++j, to += p) {
        for (Index i = 0; i < p; ++i) {
          to[i] = W(r, i) * in[j];
        }
        const double* z = Z.col(r * m + j).data();
        for (Index l = 0; l < n; ++l) {
          for (Index i = 0; i < p; ++i) {
            to[i] -= K_T(i, l) * z[l];
          }
        }
      }
      double target = 0.0;
      for (Index i = 0; i < p; ++i) {
        target += W(r, i) * out[i];
      }
      for (Index i = 0; i < n; ++i) {
        target -= C_T(i, r) * known[i];
      }
      take(row.data(), target);
    }
    for (Index column = 0; column < pairs + (start > 0 ? p : 0); ++column) {
      double* z = Z.col(column).data();
      if (column < pairs) {
        const double* c = C_T.col(column / m).data();
        for (Index i = 0; i < n; ++i) {
          moved(i) = in[column % m] * c[i];
        }
      } else {
        moved.setZero();
      }
      add_product(Phi_T, z, moved.data());
      std::copy_n(moved.data(), n, z);
    }
    moved.setZero();
    add_product(Phi, known, moved.data());
    add_product(model.K, out, moved.data());
    std::copy_n(moved.data(), n, known);
  }
}

/// F and g of h⁺ = F h + g u whose states are orthonormal for white u, [F g] with orthonormal rows,
/// F with the given eigenvalues, inside the unit circle, complex ones with their conjugates:
/// normalised lattices of two states or one in a row, each with an all-pass output for the next. F
/// beside g. Source: Gray, Markel, IEEE Trans. Acoustics, Speech, and Signal Processing 23 (1975);
/// Heuberger, Van den Hof, Wahlberg, "Modelling and Identification with Rational Orthogonal Basis
/// Functions" (2005), chapter 2.
MatrixXd orthonormal_filter(const Eigen::VectorXcd& eigenvalues) {
  const Index n = eigenvalues.size();
  MatrixXd Fg = MatrixXd::Zero(n, n + 1);
  Eigen::RowVectorXd passed = Eigen::RowVectorXd::Zero(n + 1);  // u, of [h; u].
  passed(n) = 1.0;
  const auto below = [](double k) { return std::sqrt((1.0 - k) * (1.0 + k)); };
  Index done = 0;
  const auto pair = [&](double sum, double product) {
    const double k2 = product;
    const double k1 = std::clamp(-sum / (1.0 + k2), -1.0, 1.0);
    const double c1 = below(k1);
    const double c2 = below(k2);
    Eigen::RowVectorXd inner = c2 * passed;
    inner(done + 1) -= k2;
    passed *= k2;
    passed(done + 1) += c2;
    Fg.row(done) = c1 * inner;
    Fg(done, done) -= k1;
    Fg.row(done + 1) = k1 * inner;
    Fg(done + 1, done) += c1;
    done += 2;
  };
  std::optional<double> alone;
  for (const std::complex<double>& value : eigenvalues) {
    if (value.imag() > 0.0) {
      pair(2.0 * value.real(), std::norm(value));
    } else if (value.imag() == 0.0) {
      if (alone) {
        pair(*alone + value.real(), *alone * value.real());
        alone.reset();
      } else {
        alone = value.real();
      }
    }
  }
  if (alone) {
    Fg.row(done) = below(*alone) * passed;
    Fg(done, done) += *alone;
  }
  return Fg;
}

/// T with T g = c and T F = Φᵀ T, for each column c of C_T: h of F makes z = T h of Φᵀ, and as F's
/// states are orthonormal for white inputs, T = Φᵀ T Fᵀ + c gᵀ. By Smith's squared iteration.
std::vector<MatrixXd> to_states(const MatrixXd& Phi, const MatrixXd& C_T, const MatrixXd& Fg) {
  const Index n = Phi.rows();
  std::vector<MatrixXd> T;
  for (Index r = 0; r < C_T.cols(); ++r) {
    T.emplace_back(C_T.col(r) * Fg.col(n).transpose());
  }
  MatrixXd left = Phi.transpose();
  MatrixXd right = Fg.leftCols(n).transpose();
  MatrixXd part(n, n);
  for (int doubling = 0; doubling < 60; ++doubling) {
    double step = 0.0;
    double size = 0.0;
    for (MatrixXd& of : T) {
      part.setZero();
      detail::add_product(1.0, left, of, part);
      size += of.squaredNorm();
      const MatrixXd before = of;
      detail::add_product(1.0, part, right, of);
      step += (of - before).squaredNorm();
    }
    if (!(step > 1e-34 * size)) {
      break;
    }
    part.setZero();
    detail::add_product(1.0, left, left, part);
    left.swap(part);
    part.setZero();
    detail::add_product(1.0, right, right, part);
    right.swap(part);
  }
  return T;
}

/// Σ h hᵀ of the filter from Σ h u and where its states end: with P⁺ the same sum a sample later,
/// P⁺ = F P Fᵀ + F S gᵀ + g SᵀFᵀ + g R gᵀ and P⁺ = P - h₀h₀ᵀ + h_N h_Nᵀ, for P by Smith's squared
/// iteration. False where that takes so many steps that digits are lost.
/// @param last  h after the last sample.
bool add_squares(const MatrixXd& Fg, const detail::RecordFilter& filter, Index first,
                 const double* last, MatrixXd& sums) {
  const Index n = Fg.rows();
  const MatrixXd F = Fg.leftCols(n);
  const VectorXd g = Fg.col(n);
  const Index m = filter.inputs;
  const Index filtered = m + (filter.impulse ? 1 : 0);
  const auto h_last = [&](Index j) { return Eigen::Map<const VectorXd>(last + first + j * n, n); };
  // Σ hᵢ uⱼ, nothing for the impulse, which comes before the record.
  const auto product = [&](Index i, Index j) {
    return j < m ? VectorXd(F * sums.col(j).segment(first + i * n, n)) : VectorXd::Zero(n);
  };
  for (Index j = 0; j < filtered; ++j) {
    for (Index i = j; i < filtered; ++i) {
      MatrixXd Q = product(i, j) * g.transpose() + g * product(j, i).transpose() -
                   h_last(i) * h_last(j).transpose();
      if (i < m) {
        Q += g * (sums(i, j) * g.transpose());
      } else if (j == m) {
        Q += g * g.transpose();
      }
      sums.block(first + i * n, first + j * n, n, n) = Q;
    }
  }
  MatrixXd power = F;
  MatrixXd half(n, n);
  for (int doubling = 0; doubling < 14; ++doubling) {
    const MatrixXd turned = power.transpose();
    for (Index j = 0; j < filtered; ++j) {
      for (Index i = j; i < filtered; ++i) {
        auto P = sums.block(first + i * n, first + j * n, n, n);
        half.setZero();
        detail::add_product(1.0, power, P, half);
        detail::add_product(1.0, half, turned, P);
      }
    }
    if (power.squaredNorm() < 1e-17) {
      return true;
    }
    half.setZero();
    detail::add_product(1.0, power, power, half);
    power.swap(half);
  }
  return false;
}

/// x of S x = b, S's lower triangle given; nothing where more than half of the digits are lost.
std::optional<VectorXd> solve_normal(MatrixXd S, const VectorXd& b) {
  const VectorXd unit = S.diagonal().unaryExpr(
      [](double square) { return square > 0.0 ? 1.0 / std::sqrt(square) : 0.0; });
  S = MatrixXd(unit.asDiagonal() * S * unit.asDiagonal());
  constexpr double least = 1e-8;
  if (!detail::cholesky_in_place(S) || !(S.diagonal().array().square() > least).all()) {
    return std::nullopt;
  }
  VectorXd x = unit.cwiseProduct(b);
  const Index size = x.size();
  for (Index j = 0; j < size; ++j) {
    x(j) /= S(j, j);
    x.tail(size - j - 1) -= x(j) * S.col(j).tail(size - j - 1);
  }
  for (Index j = size - 1; j >= 0; --j) {
    x(j) = (x(j) - S.col(j).tail(size - j - 1).dot(x.tail(size - j - 1))) / S(j, j);
  }
  return VectorXd(unit.cwiseProduct(x));
}

/// The regression by sums of products, of which each sample needs few: instead of one filter a pair
/// of output and input one an input, whose states make those of all outputs.
///
/// Unknown are x0, B - K D and W D, which meet the sums one by one.
std::optional<VectorXd> regress_by_products(const ScaledSignals& record,
                                            const InnovationsModel& model, const MatrixXd& W,
                                            const SubspaceOptions& options) {
  const Index n = model.system.A.rows();
  const Index m = record.inputs;
  const Index p = record.outputs();
  const MatrixXd C_T = (W * model.system.C).transpose();
  const MatrixXd Phi = model.system.A - model.K * model.system.C;
  MatrixXd Fg(n, n + 1);
  std::vector<MatrixXd> T;
  if (p == 1) {
    Fg << Phi.transpose(), C_T;
    T.emplace_back(MatrixXd::Identity(n, n));
  } else {
    const Eigen::VectorXcd modes = detail::eigenvalues_of(Phi);
    if (!(modes.cwiseAbs().maxCoeff() < 1.0 - 1e-9)) {
      return std::nullopt;
    }
    Fg = orthonormal_filter(modes);
    T = to_states(Phi, C_T, Fg);
  }

  const auto fours = [](Index rows) { return (rows + 3) / 4 * 4; };
  MatrixXd F = MatrixXd::Zero(fours(n), n + 1);
  F.topRows(n) = Fg;
  MatrixXd both = MatrixXd::Zero(fours(n + p), n + p);
  both.topLeftCorner(n, n) = Phi;
  both.block(0, n, n, p) = model.K;
  both.block(n, 0, p, n) = -C_T.transpose();
  both.block(n, n, p, p) = W;
  detail::RecordFilter filter;
  filter.states = static_cast<int>(n);
  filter.inputs = static_cast<int>(m);
  filter.impulse = options.initial_state;
  filter.F = F.data();
  filter.both = both.data();
  const Index rows = detail::filter_rows(filter, static_cast<int>(m + p));
  MatrixXd sums(rows, rows);
  std::vector<double> memory(
      static_cast<std::size_t>(detail::filter_workspace(filter.states, static_cast<int>(m + p))));
  const auto sum = [&] {
    sums.setZero();
    detail::sum_filtered(record.view(), filter, sums.data(), static_cast<int>(rows), memory.data());
  };
  filter.squares = p == 1;
  sum();
  if (!filter.squares && !add_squares(Fg, filter, m + p, memory.data(), sums)) {
    filter.squares = true;
    sum();
  }

  // Blocks of unknowns: the columns of B - K D and x0, one a filtered signal; then W D.
  const Index filtered = m + (options.initial_state ? 1 : 0);
  const Index states = n * filtered;
  const Index direct = options.feedthrough ? p * m : 0;
  const Index first = m + p;  // Of h.
  MatrixXd S = MatrixXd::Zero(states + direct, states + direct);
  VectorXd b = VectorXd::Zero(states + direct);
  MatrixXd turned(states, n);
  for (Index r = 0; r < p; ++r) {
    const MatrixXd& to = T[static_cast<std::size_t>(r)];
    for (Index j = 0; j < filtered; ++j) {
      // Σ h hᵀ of the signals from this one on, from the right, then from the left.
      MatrixXd square = sums.block(first + j * n, first + j * n, states - j * n, n);
      square.topRows(n).triangularView<Eigen::StrictlyUpper>() =
          square.topRows(n).transpose().triangularView<Eigen::StrictlyUpper>();
      turned.topRows(states - j * n).setZero();
      detail::add_product_transposed(1.0, square, to, turned.topRows(states - j * n));
      for (Index i = j; i < filtered; ++i) {
        detail::add_product(1.0, to, turned.middleRows((i - j) * n, n),
                            S.block(i * n, j * n, n, n));
      }
      b.segment(j * n, n) += to * sums.col(m + r).segment(first + j * n, n);
      for (Index i = 0; direct > 0 && i < m; ++i) {
        S.row(states + i * p + r).segment(j * n, n) = to * sums.col(i).segment(first + j * n, n);
      }
    }
    for (Index j = 0; direct > 0 && j < m; ++j) {
      for (Index i = j; i < m; ++i) {
        S(states + i * p + r, states + j * p + r) = sums(i, j);
      }
      b(states + j * p + r) = sums(m + r, j);
    }
  }
  std::optional<VectorXd> found = solve_normal(std::move(S), b);
  if (!found || !found->allFinite()) {
    return std::nullopt;
  }
  VectorXd inputs = found->head(n * m);
  if (direct > 0) {
    MatrixXd D = found->tail(direct).reshaped(p, m);
    D = MatrixXd(W.triangularView<Eigen::Lower>().solve(D));
    found->tail(direct) = D.reshaped();
    inputs += (model.K * D).reshaped();
  }
  const VectorXd start = found->segment(n * m, states - n * m);
  found->head(states) << start, inputs;
  return found;
}

}  // namespace

Expected<VectorXd> regress_inputs(const ScaledSignals& record, const InnovationsModel& model,
                                  const MatrixXd& W, const SubspaceOptions& options, bool noisy) {
  const Index n = model.system.A.rows();
  const Index m = record.inputs;
  const Index p = record.outputs();
  const Index size = (options.initial_state ? n : 0) + n * m + (options.feedthrough ? p * m : 0);
  if (noisy) {
    if (auto found = regress_by_products(record, model, W, options)) {
      return *std::move(found);
    }
  }
  FLYBALL_TRY(auto stream, StreamedLeastSquares::create(size));
  each_row(record, model, W, options, size,
           [&](const double* row, double target) { stream.add(row, target); });
  const MatrixXd R = stream.factor();
  VectorXd unit = R.leftCols(size).colwise().norm();
  unit = unit.unaryExpr([](double norm) { return norm > 0.0 ? 1.0 / norm : 0.0; });
  const MatrixXd found =
      detail::solve_least_squares(R.leftCols(size) * unit.asDiagonal(), R.col(size + 1));
  if (!found.allFinite()) {
    return refusal(IdentificationError::singular, "fit_subspace")
        .hint("excite every input, or take a smaller order");
  }
  return VectorXd(unit.cwiseProduct(found.col(0)));
}

}  // namespace flyball::identification
