#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "identification/subspace_data.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "math/dense/panels.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// A row of H: signal `channel` of [u y], `shift` samples late.
struct HankelRow {
  Index channel;
  Index shift;
};

std::vector<HankelRow> rows_of(Index m, Index p, Index s) {
  std::vector<HankelRow> rows;
  const auto block = [&](Index first_channel, Index channels, Index first_shift) {
    for (Index shift = first_shift; shift < first_shift + s; ++shift) {
      for (Index channel = 0; channel < channels; ++channel) {
        rows.push_back({first_channel + channel, shift});
      }
    }
  };
  block(0, m, s);
  block(0, m, 0);
  block(m, p, 0);
  block(m, p, s);
  return rows;
}

/// H Hᵀ: what it says of samples a and b late follows from a - 1 and b - 1 by what enters and what
/// leaves.
MatrixXd correlations(const ScaledSignals& record, Index s) {
  const Index m = record.inputs;
  const Index p = record.outputs();
  const Index channels = m + p;
  const Index columns = record.samples() - 2 * s + 1;
  const MatrixXd& w = record.w;
  const Index apart = (2 * s + 3) / 4 * 4;
  MatrixXd products(apart, channels * channels);
  detail::lag_products(record.view(), static_cast<int>(columns), static_cast<int>(2 * s),
                       products.data());

  const auto at = [&](Index shift, Index channel) {
    return channel < m ? (shift < s ? s + shift : shift - s) * m + channel
                       : 2 * s * m + shift * p + channel - m;
  };
  const Index size = 2 * s * channels;
  VectorXd enters(size);
  VectorXd leaves(size);
  for (Index channel = 0; channel < channels; ++channel) {
    for (Index shift = 1; shift < 2 * s; ++shift) {
      enters(at(shift, channel)) = w(columns + shift - 1, channel);
      leaves(at(shift, channel)) = w(shift - 1, channel);
    }
  }
  MatrixXd G(size, size);
  for (Index j = 0; j < channels; ++j) {
    for (Index i = 0; i < channels; ++i) {
      const auto early = products.col(j * channels + i);  // wᵢ first
      const auto late = products.col(i * channels + j);   // wⱼ first
      for (Index shift = 0; shift < 2 * s; ++shift) {
        G(at(0, i), at(shift, j)) = early(shift);
        G(at(shift, i), at(0, j)) = late(shift);
      }
    }
  }
  struct Run {
    Index from;
    Index to;
    Index count;
  };
  // Rows of the same kind, a sample later: the inputs' future begins where their past ends.
  const Run runs[] = {{s * m, s * m + m, (s - 1) * m},
                      {2 * s * m - m, 0, m},
                      {0, m, (s - 1) * m},
                      {2 * s * m, 2 * s * m + p, (2 * s - 1) * p}};
  for (Index shift = 1; shift < 2 * s; ++shift) {
    for (Index j = 0; j < channels; ++j) {
      const Index column = at(shift, j);
      const double* before = G.col(at(shift - 1, j)).data();
      double* now = G.col(column).data();
      const double in = enters(column);
      const double out = leaves(column);
      for (const Run& run : runs) {
        // No more than the lower triangle is asked for: of outputs nothing is told to inputs.
        if (j >= m && run.from < 2 * s * m) {
          continue;
        }
        for (Index k = 0; k < run.count; ++k) {
          const Index row = run.to + k;
          now[row] = before[run.from + k] + (enters(row) * in - leaves(row) * out);
        }
      }
    }
  }
  return G;
}

/// Cholesky of H Hᵀ, or nothing where squaring the data has lost what matters.
std::optional<PastAndFuture> by_correlations(const ScaledSignals& record, Index s) {
  MatrixXd G = correlations(record, s);
  const Index future = s * record.outputs();
  MatrixXd left = G.bottomRightCorner(future, future);
  const VectorXd squares = G.diagonal();
  if (!detail::cholesky_in_place(G)) {
    return std::nullopt;
  }
  // Half of the digits are left at 1e-8.
  constexpr double least = 1e-8;
  if (!(G.diagonal().array().square() > least * squares.array()).all()) {
    return std::nullopt;
  }
  const auto told = G.bottomLeftCorner(future, s * record.inputs);
  detail::add_product_transposed(-1.0, told, told, left, true);
  G.triangularView<Eigen::StrictlyUpper>().setZero();
  return PastAndFuture{std::move(G), record.samples() - 2 * s + 1, std::move(left)};
}

MatrixXd by_reflections(const ScaledSignals& record, Index s) {
  const MatrixXd& w = record.w;
  const std::vector<HankelRow> rows = rows_of(record.inputs, record.outputs(), s);
  const Index columns = record.samples() - 2 * s + 1;
  const auto size = static_cast<Index>(rows.size());
  const Index most = std::max<Index>(2000, 4 * size);
  MatrixXd R(0, size);
  for (Index first = 0; first < columns; first += most) {
    const Index count = std::min(most, columns - first);
    MatrixXd stack(R.rows() + count, size);
    stack.topRows(R.rows()) = R;
    for (Index i = 0; i < size; ++i) {
      const HankelRow& row = rows[static_cast<std::size_t>(i)];
      stack.col(i).tail(count) = w.col(row.channel).segment(first + row.shift, count);
    }
    R = detail::triangle_of(stack);
  }
  MatrixXd L = MatrixXd::Zero(size, size);
  L.leftCols(R.rows()) = R.transpose();
  return L;
}

}  // namespace

ScaledSignals scaled(const MatrixRef& u, const MatrixRef& y) {
  const Index samples = u.rows();
  const Index channels = u.cols() + y.cols();
  ScaledSignals record{MatrixXd(samples + detail::record_margin, channels), u.cols(),
                       VectorXd(channels)};
  record.w.bottomRows(detail::record_margin).setZero();
  for (Index j = 0; j < channels; ++j) {
    const auto signal = j < u.cols() ? u.col(j) : y.col(j - u.cols());
    const double square = signal.squaredNorm();
    const bool ordinary = square > 1e-280 && square < 1e280;
    const double size = (ordinary ? std::sqrt(square) : signal.stableNorm()) /
                        std::sqrt(static_cast<double>(samples));
    record.unit(j) = size > 0.0 ? std::ldexp(1.0, std::ilogb(size)) : 1.0;
    record.w.col(j).head(samples) = signal * (1.0 / record.unit(j));
  }
  return record;
}

PastAndFuture compress(const ScaledSignals& record, Index block_rows) {
  if (auto found = by_correlations(record, block_rows)) {
    return *std::move(found);
  }
  return {by_reflections(record, block_rows), record.samples() - 2 * block_rows + 1, MatrixXd()};
}

MatrixXd prediction_squares(const ScaledSignals& record, const InnovationsModel& model) {
  const DiscreteSystem<>& system = model.system;
  const Index n = system.A.rows();
  const Index m = record.inputs;
  const Index p = record.outputs();
  // Both inputs and outputs are what the filter of y reads; in place of the inputs it leaves zeros.
  const Index rows = n + m + p;
  MatrixXd both = MatrixXd::Zero((rows + 3) / 4 * 4, rows);
  both.topLeftCorner(n, n) = system.A - model.K * system.C;
  both.block(0, n, n, m) = system.B - model.K * system.D;
  both.block(0, n + m, n, p) = model.K;
  both.block(n + m, 0, p, n) = -system.C;
  both.block(n + m, n, p, m) = -system.D;
  both.block(n + m, n + m, p, p).setIdentity();
  const MatrixXd F = MatrixXd::Zero((n + 3) / 4 * 4, n + 1);
  detail::RecordFilter filter;
  filter.states = static_cast<int>(n);
  filter.F = F.data();
  filter.both = both.data();
  filter.x0 = model.x0.data();
  MatrixXd sums = MatrixXd::Zero(m + p, m + p);
  std::vector<double> memory(
      static_cast<std::size_t>(detail::filter_workspace(filter.states, static_cast<int>(m + p))));
  detail::sum_filtered(record.view(), filter, sums.data(), static_cast<int>(m + p), memory.data());
  MatrixXd squares = sums.bottomRightCorner(p, p);
  return squares.selfadjointView<Eigen::Lower>();
}

}  // namespace flyball::identification
