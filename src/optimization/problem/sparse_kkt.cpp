// The KKT systems of sparse programs: along stages where there are some, else by sparse factors.
#include <algorithm>

#include "optimization/problem/sparse_program.hpp"

namespace flyball::optimization::detail {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// What stands for 0 on the diagonal of an equality's multiplier.
constexpr double regularization = 1e-9;

}  // namespace

void SparseProgram::analyze() {
  analyzed_ = true;
  values_moved_ = false;
  along_.assign(static_cast<std::size_t>(m_), 0.0);
  stages_ = std::make_unique<StageFactor>();
  if (stages_->find({n_, m_, a_start_, a_columns_, a_linear_, a_is_linear_, flat_.equality, h_rows_,
                     h_columns_, fixed_})) {
    return;
  }
  stages_.reset();
  std::vector<int> rows;
  std::vector<int> columns;
  for (int i = 0; i < n_ + m_; ++i) {
    rows.push_back(i);
    columns.push_back(i);
  }
  const auto is_fixed = [&](int i) { return fixed_[static_cast<std::size_t>(i)] != 0; };
  // Entries of fixed variables stand on the diagonal, as zeros.
  for (std::size_t e = 0; e < h_.size(); ++e) {
    const bool out = is_fixed(h_rows_[e]) || is_fixed(h_columns_[e]);
    rows.push_back(h_rows_[e]);
    columns.push_back(out ? h_rows_[e] : h_columns_[e]);
  }
  for (int r = 0; r < m_; ++r) {
    for (int e = a_start_[static_cast<std::size_t>(r)];
         e < a_start_[static_cast<std::size_t>(r) + 1]; ++e) {
      const int column = a_columns_[static_cast<std::size_t>(e)];
      rows.push_back(n_ + r);
      columns.push_back(is_fixed(column) ? n_ + r : column);
    }
  }
  ldlt_.analyze(n_ + m_, rows, columns);
  kkt_.assign(rows.size(), 0.0);
  rhs_.assign(static_cast<std::size_t>(n_ + m_), 0.0);
}

bool SparseProgram::factor(const VectorXd& diagonal, const VectorXd& D, bool with_hessian) {
  if (!analyzed_) {
    analyze();
  }
  bool soft = false;
  for (std::size_t r = 0; r < static_cast<std::size_t>(m_); ++r) {
    double d = D(static_cast<Index>(r));
    if (slack_[r] >= 0) {
      slack_diagonal_[r] = diagonal(slack_[r]);
      if (!(slack_diagonal_[r] > 0.0)) {
        return false;
      }
      d += 1.0 / slack_diagonal_[r];
    } else {
      soft = soft || d > 0.0;
    }
    row_diagonal_[r] = std::max(d, regularization);
  }
  if (stages_) {
    if (!values_moved_) {
      stages_->set_values(h_, a_);
      values_moved_ = true;
    }
    return stages_->factor(diagonal.data(), row_diagonal_.data(), soft, with_hessian);
  }
  double* to = kkt_.data();
  for (int i = 0; i < n_; ++i) {
    *to++ = fixed_[static_cast<std::size_t>(i)] != 0 ? 1.0 : diagonal(i);
  }
  for (const double d : row_diagonal_) {
    *to++ = -d;
  }
  for (std::size_t e = 0; e < h_.size(); ++e) {
    const bool out = fixed_[static_cast<std::size_t>(h_rows_[e])] != 0 ||
                     fixed_[static_cast<std::size_t>(h_columns_[e])] != 0;
    *to++ = out || !with_hessian ? 0.0 : h_[e];
  }
  for (std::size_t e = 0; e < a_.size(); ++e) {
    *to++ = fixed_[static_cast<std::size_t>(a_columns_[e])] != 0 ? 0.0 : a_[e];
  }
  return ldlt_.factor(kkt_.data()) && ldlt_.negative_pivots() == m_;
}

void SparseProgram::solve(const VectorXd& rw, const VectorXd& rc, VectorXd& dw, VectorXd& dl) {
  for (std::size_t r = 0; r < static_cast<std::size_t>(m_); ++r) {
    along_[r] = rc(static_cast<Index>(r));
    if (slack_[r] >= 0) {
      along_[r] += rw(slack_[r]) / slack_diagonal_[r];
    }
  }
  if (stages_) {
    stages_->solve(rw.data(), along_.data(), dw.data(), dl.data());
  } else {
    for (std::size_t i = 0; i < static_cast<std::size_t>(n_); ++i) {
      rhs_[i] = fixed_[i] != 0 ? 0.0 : -rw.data()[i];
    }
    for (std::size_t r = 0; r < static_cast<std::size_t>(m_); ++r) {
      rhs_[static_cast<std::size_t>(n_) + r] = -along_[r];
    }
    ldlt_.solve(rhs_.data());
    std::copy_n(rhs_.data(), n_, dw.data());
    std::copy_n(rhs_.data() + n_, m_, dl.data());
  }
  for (std::size_t r = 0; r < static_cast<std::size_t>(m_); ++r) {
    if (slack_[r] >= 0) {
      dw(slack_[r]) = (dl(static_cast<Index>(r)) - rw(slack_[r])) / slack_diagonal_[r];
    }
  }
}

bool SparseProgram::roll(const VectorXd& w, VectorXd& side, VectorXd& dw) {
  return stages_ && w.size() == n_ &&  // slacks follow from what they are of
         stages_->roll(w.data(), lower.data(), upper.data(), side.data(), dw.data());
}

}  // namespace flyball::optimization::detail
