#include <algorithm>
#include <optional>
#include <vector>

#include "identification/subspace_data.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;

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

/// Cholesky of H Hᵀ, or nothing where squaring the data has lost what matters.
std::optional<MatrixXd> by_correlations(const MatrixXd& w, Index s,
                                        const std::vector<HankelRow>& rows) {
  const Index columns = w.rows() - 2 * s + 1;
  const Index channels = w.cols();
  // G_ab = Σ w_(t+a) w_(t+b)ᵀ; G_(a+1)(b+1) differs by what enters and what leaves.
  MatrixXd G(2 * s * channels, 2 * s * channels);
  for (Index b = 0; b < 2 * s; ++b) {
    for (Index j = 0; j < channels; ++j) {
      for (Index i = 0; i < channels; ++i) {
        G(i, b * channels + j) = w.col(i).head(columns).dot(w.col(j).segment(b, columns));
      }
    }
  }
  for (Index a = 1; a < 2 * s; ++a) {
    for (Index b = a; b < 2 * s; ++b) {
      for (Index j = 0; j < channels; ++j) {
        for (Index i = 0; i < channels; ++i) {
          G(a * channels + i, b * channels + j) =
              G((a - 1) * channels + i, (b - 1) * channels + j) +
              w(columns + a - 1, i) * w(columns + b - 1, j) - w(a - 1, i) * w(b - 1, j);
        }
      }
    }
  }
  const auto size = static_cast<Index>(rows.size());
  MatrixXd ordered(size, size);
  for (Index j = 0; j < size; ++j) {
    const HankelRow& second = rows[static_cast<std::size_t>(j)];
    for (Index i = 0; i < size; ++i) {
      const HankelRow& first = rows[static_cast<std::size_t>(i)];
      ordered(i, j) =
          first.shift <= second.shift
              ? G(first.shift * channels + first.channel, second.shift * channels + second.channel)
              : G(second.shift * channels + second.channel, first.shift * channels + first.channel);
    }
  }
  std::optional<MatrixXd> L = detail::cholesky_of(ordered);
  // Half of the digits are left at 1e-8.
  constexpr double least = 1e-8;
  if (L && (L->diagonal().array().square() > least * ordered.diagonal().array()).all()) {
    return L;
  }
  return std::nullopt;
}

MatrixXd by_reflections(const MatrixXd& w, Index s, const std::vector<HankelRow>& rows) {
  const Index columns = w.rows() - 2 * s + 1;
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

PastAndFuture compress(const MatrixXd& u, const MatrixXd& y, Index block_rows) {
  MatrixXd w(u.rows(), u.cols() + y.cols());
  w << u, y;
  const std::vector<HankelRow> rows = rows_of(u.cols(), y.cols(), block_rows);
  const Index columns = u.rows() - 2 * block_rows + 1;
  std::optional<MatrixXd> L = by_correlations(w, block_rows, rows);
  return {L ? *std::move(L) : by_reflections(w, block_rows, rows), columns};
}

}  // namespace flyball::identification
