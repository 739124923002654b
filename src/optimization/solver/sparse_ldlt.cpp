#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

#include "optimization/solver/sparse_ldlt.hpp"

namespace flyball::optimization::detail {

void SparseLdlt::analyze(int size, const std::vector<int>& rows, const std::vector<int>& columns) {
  size_ = size;
  const auto n = static_cast<std::size_t>(size);
  {
    std::vector<Eigen::Triplet<double, int>> entries;
    entries.reserve(2 * rows.size());
    for (std::size_t e = 0; e < rows.size(); ++e) {
      entries.emplace_back(rows[e], columns[e], 1.0);
      if (rows[e] != columns[e]) {
        entries.emplace_back(columns[e], rows[e], 1.0);
      }
    }
    Eigen::SparseMatrix<double, Eigen::ColMajor, int> pattern(size, size);
    pattern.setFromTriplets(entries.begin(), entries.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
    Eigen::AMDOrdering<int>()(pattern, permutation);
    // indices()[k] is the old index at the new place k.
    order_.resize(n);
    for (int k = 0; k < size; ++k) {
      order_[static_cast<std::size_t>(permutation.indices()[k])] = k;
    }
  }
  // The upper triangle of the permuted matrix, by columns, duplicates merged.
  std::vector<std::pair<long long, int>> keys(rows.size());
  for (std::size_t e = 0; e < rows.size(); ++e) {
    const int i = order_[static_cast<std::size_t>(rows[e])];
    const int j = order_[static_cast<std::size_t>(columns[e])];
    keys[e] = {static_cast<long long>(std::max(i, j)) * size + std::min(i, j), static_cast<int>(e)};
  }
  std::sort(keys.begin(), keys.end());
  place_.resize(rows.size());
  ap_.assign(n + 1, 0);
  ai_.clear();
  long long last = -1;
  for (const auto& [key, entry] : keys) {
    if (key != last) {
      last = key;
      ai_.push_back(static_cast<int>(key % size));
      ++ap_[static_cast<std::size_t>(key / size) + 1];
    }
    place_[static_cast<std::size_t>(entry)] = static_cast<int>(ai_.size()) - 1;
  }
  std::partial_sum(ap_.begin(), ap_.end(), ap_.begin());
  ax_.assign(ai_.size(), 0.0);

  parent_.assign(n, -1);
  count_.assign(n, 0);
  flag_.assign(n, -1);
  pattern_.assign(n, 0);
  for (int k = 0; k < size; ++k) {
    flag_[static_cast<std::size_t>(k)] = k;
    for (int p = ap_[static_cast<std::size_t>(k)]; p < ap_[static_cast<std::size_t>(k) + 1]; ++p) {
      for (int i = ai_[static_cast<std::size_t>(p)]; flag_[static_cast<std::size_t>(i)] != k;
           i = parent_[static_cast<std::size_t>(i)]) {
        if (parent_[static_cast<std::size_t>(i)] == -1) {
          parent_[static_cast<std::size_t>(i)] = k;
        }
        ++count_[static_cast<std::size_t>(i)];
        flag_[static_cast<std::size_t>(i)] = k;
      }
    }
  }
  lp_.assign(n + 1, 0);
  for (std::size_t k = 0; k < n; ++k) {
    lp_[k + 1] = lp_[k] + count_[k];
  }
  li_.assign(static_cast<std::size_t>(lp_[n]), 0);
  lx_.assign(li_.size(), 0.0);
  d_.assign(n, 0.0);
  y_.assign(n, 0.0);
}

bool SparseLdlt::factor(const double* values) {
  std::fill(ax_.begin(), ax_.end(), 0.0);
  for (std::size_t e = 0; e < place_.size(); ++e) {
    ax_[static_cast<std::size_t>(place_[e])] += values[e];
  }
  negative_ = 0;
  // Row k of L solves the triangle of the rows before it.
  std::fill(count_.begin(), count_.end(), 0);
  std::fill(flag_.begin(), flag_.end(), -1);
  const int* const ap = ap_.data();
  const int* const ai = ai_.data();
  int* const flag = flag_.data();
  int* const pattern = pattern_.data();
  double* const y = y_.data();
  for (int k = 0; k < size_; ++k) {
    int top = size_;
    flag[k] = k;
    y[k] = 0.0;
    double size = 0.0;
    for (int p = ap[k]; p < ap[k + 1]; ++p) {
      int i = ai[p];
      y[i] += ax_[static_cast<std::size_t>(p)];
      int length = 0;
      for (; flag[i] != k; i = parent_[static_cast<std::size_t>(i)]) {
        pattern[length++] = i;
        flag[i] = k;
      }
      while (length > 0) {
        pattern[--top] = pattern[--length];
      }
    }
    double pivot = y[k];
    size = std::abs(pivot);
    y[k] = 0.0;
    for (; top < size_; ++top) {
      const int i = pattern[top];
      const double y_i = y[i];
      y[i] = 0.0;
      const int begin = lp_[static_cast<std::size_t>(i)];
      const int end = begin + count_[static_cast<std::size_t>(i)];
      for (int p = begin; p < end; ++p) {
        y[li_[static_cast<std::size_t>(p)]] -= lx_[static_cast<std::size_t>(p)] * y_i;
      }
      const double l = y_i / d_[static_cast<std::size_t>(i)];
      const double change = l * y_i;
      size = std::max(size, std::abs(change));
      pivot -= change;
      li_[static_cast<std::size_t>(end)] = k;
      lx_[static_cast<std::size_t>(end)] = l;
      ++count_[static_cast<std::size_t>(i)];
    }
    // What cancellation left is no pivot.
    if (!(std::abs(pivot) > 1e-15 * size) || !std::isfinite(pivot)) {
      std::fill(y_.begin(), y_.end(), 0.0);
      return false;
    }
    d_[static_cast<std::size_t>(k)] = pivot;
    negative_ += pivot < 0.0 ? 1 : 0;
  }
  return true;
}

void SparseLdlt::solve(double* x) {
  const auto n = static_cast<std::size_t>(size_);
  double* const b = y_.data();
  for (std::size_t i = 0; i < n; ++i) {
    b[order_[i]] = x[i];
  }
  for (std::size_t j = 0; j < n; ++j) {
    for (int p = lp_[j]; p < lp_[j + 1]; ++p) {
      b[li_[static_cast<std::size_t>(p)]] -= lx_[static_cast<std::size_t>(p)] * b[j];
    }
  }
  for (std::size_t j = n; j-- > 0;) {
    double sum = b[j] / d_[j];
    for (int p = lp_[j]; p < lp_[j + 1]; ++p) {
      sum -= lx_[static_cast<std::size_t>(p)] * b[li_[static_cast<std::size_t>(p)]];
    }
    b[j] = sum;
  }
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = b[order_[i]];
  }
  std::fill(y_.begin(), y_.end(), 0.0);
}

}  // namespace flyball::optimization::detail
