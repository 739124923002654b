#include <algorithm>
#include <cmath>
#include <utility>

#include "core/constants.hpp"
#include "optimization/problem/sparse_program.hpp"

namespace flyball::optimization::detail {

using Eigen::Index;
using Eigen::VectorXd;
using expression::LaneTape;

namespace {

constexpr std::size_t lanes = LaneTape::lanes;

}  // namespace

SparseProgram::SparseProgram(FlatProblem flat)
    : flat_(std::move(flat)), n_(flat_.variables), m_(flat_.rows()) {
  for (const Shape& shape : flat_.shapes) {
    Compiled compiled;
    compiled.functions = expression::lagrangian(shape.tape, shape.variables);
    compiled.values = LaneTape(values_of(compiled.functions));
    compiled.derivatives = LaneTape(compiled.functions.tape);
    compiled.value_work.resize(compiled.values.workspace_size());
    compiled.derivative_work.resize(compiled.derivatives.workspace_size());
    compiled.values.prepare({}, compiled.value_work.data());
    compiled.derivatives.prepare({}, compiled.derivative_work.data());
    compiled_.push_back(std::move(compiled));
  }
  int next = n_;
  for (int r = 0; r < m_; ++r) {
    slack_.push_back(flat_.equality[static_cast<std::size_t>(r)] != 0 ? -1 : next++);
  }
  constraint_count = m_;
  lower.setZero(next);
  upper.setConstant(next, infinity);
  fixed_.assign(static_cast<std::size_t>(n_), 0);
  row_scale_.assign(static_cast<std::size_t>(m_), 1.0);
  slack_diagonal_.assign(static_cast<std::size_t>(m_), 0.0);
  row_diagonal_.assign(static_cast<std::size_t>(m_), 0.0);
  build_pattern();
  refresh();
}

bool SparseProgram::is_quadratic() const noexcept {
  return flat_.cost_degree <= Degree::quadratic && flat_.equality_degree <= Degree::linear &&
         flat_.inequality_degree <= Degree::linear;
}

bool SparseProgram::update(FlatProblem& flat) {
  const bool same = flat.variables == n_ && flat.rows() == m_ && flat.columns == flat_.columns &&
                    flat.row_start == flat_.row_start && flat.equality == flat_.equality &&
                    flat.constraint == flat_.constraint &&
                    flat.shapes.size() == flat_.shapes.size() &&
                    flat.cost_degree == flat_.cost_degree &&
                    std::equal(flat.shapes.begin(), flat.shapes.end(), flat_.shapes.begin(),
                               [](const Shape& a, const Shape& b) {
                                 return a.columns == b.columns && a.rows == b.rows &&
                                        std::equal(a.tape.nodes().begin(), a.tape.nodes().end(),
                                                   b.tape.nodes().begin(), b.tape.nodes().end());
                               });
  if (!same || !fixes_the_same(flat)) {
    return false;
  }
  flat_ = std::move(flat);
  refresh();
  return true;
}

bool SparseProgram::renew(const ExpressionGraph& graph, const Expression& cost,
                          const Constraints& constraints) {
  if (!renew_numbers(graph, cost, constraints, flat_) || !fixes_the_same(flat_)) {
    return false;
  }
  refresh();
  return true;
}

bool SparseProgram::fixes_the_same(const FlatProblem& flat) const {
  for (std::size_t i = 0; i < fixed_.size(); ++i) {
    if ((flat.lower[i] == flat.upper[i]) != (fixed_[i] != 0)) {
      return false;
    }
  }
  return true;
}

void SparseProgram::build_pattern() {
  // Columns of each row: those of its linear part and of its terms.
  std::vector<std::vector<int>> columns(static_cast<std::size_t>(m_));
  for (std::size_t r = 0; r < columns.size(); ++r) {
    columns[r].assign(flat_.columns.begin() + flat_.row_start[r],
                      flat_.columns.begin() + flat_.row_start[r + 1]);
  }
  std::vector<long long> hessian;
  for (std::size_t s = 0; s < flat_.shapes.size(); ++s) {
    const Shape& shape = flat_.shapes[s];
    for (std::size_t t = 0; t < shape.rows.size(); ++t) {
      const int* const at = shape.columns.data() + t * shape.variables;
      if (shape.rows[t] >= 0) {
        auto& row = columns[static_cast<std::size_t>(shape.rows[t])];
        for (const expression::Entry& entry : compiled_[s].functions.jacobian) {
          row.push_back(at[entry.column]);
        }
      }
      for (const expression::Entry& entry : compiled_[s].functions.hessian) {
        const int i = at[entry.row];
        const int j = at[entry.column];
        hessian.push_back(static_cast<long long>(std::max(i, j)) * n_ + std::min(i, j));
      }
    }
  }
  a_start_.assign(1, 0);
  for (auto& row : columns) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    a_columns_.insert(a_columns_.end(), row.begin(), row.end());
    a_start_.push_back(static_cast<int>(a_columns_.size()));
  }
  std::sort(hessian.begin(), hessian.end());
  hessian.erase(std::unique(hessian.begin(), hessian.end()), hessian.end());
  for (const long long key : hessian) {
    h_rows_.push_back(static_cast<int>(key / n_));
    h_columns_.push_back(static_cast<int>(key % n_));
  }
  linear_places_.reserve(flat_.columns.size());
  for (std::size_t r = 0; r < static_cast<std::size_t>(m_); ++r) {
    const auto begin = a_columns_.begin() + a_start_[r];
    const auto end = a_columns_.begin() + a_start_[r + 1];
    for (int e = flat_.row_start[r]; e < flat_.row_start[r + 1]; ++e) {
      const auto at = std::lower_bound(begin, end, flat_.columns[static_cast<std::size_t>(e)]);
      linear_places_.push_back(static_cast<int>(at - a_columns_.begin()));
    }
  }
  a_linear_.assign(a_columns_.size(), 0.0);
  a_is_linear_.assign(a_columns_.size(), 1);
  h_.assign(hessian.size(), 0.0);
  a_.assign(a_columns_.size(), 0.0);
  for (std::size_t s = 0; s < flat_.shapes.size(); ++s) {
    const Shape& shape = flat_.shapes[s];
    Compiled& compiled = compiled_[s];
    for (std::size_t t = 0; t < shape.rows.size(); ++t) {
      const int* const at = shape.columns.data() + t * shape.variables;
      for (const expression::Entry& entry : compiled.functions.jacobian) {
        int place = at[entry.column];
        if (shape.rows[t] >= 0) {
          const auto begin = a_columns_.begin() + a_start_[static_cast<std::size_t>(shape.rows[t])];
          const auto end =
              a_columns_.begin() + a_start_[static_cast<std::size_t>(shape.rows[t]) + 1];
          place = static_cast<int>(std::lower_bound(begin, end, place) - a_columns_.begin());
          a_is_linear_[static_cast<std::size_t>(place)] = 0;
        }
        compiled.jacobian_places.push_back(place);
      }
      for (const expression::Entry& entry : compiled.functions.hessian) {
        const int i = at[entry.row];
        const int j = at[entry.column];
        const long long key = static_cast<long long>(std::max(i, j)) * n_ + std::min(i, j);
        compiled.hessian_places.push_back(static_cast<int>(
            std::lower_bound(hessian.begin(), hessian.end(), key) - hessian.begin()));
      }
    }
  }
}

void SparseProgram::refresh() {
  for (int i = 0; i < n_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    lower(i) = flat_.lower[k];
    upper(i) = flat_.upper[k];
    const bool was = fixed_[k] != 0;
    fixed_[k] = flat_.lower[k] == flat_.upper[k] ? 1 : 0;
    analyzed_ = analyzed_ && was == (fixed_[k] != 0);
  }
  std::fill(a_linear_.begin(), a_linear_.end(), 0.0);
  for (std::size_t e = 0; e < linear_places_.size(); ++e) {
    a_linear_[static_cast<std::size_t>(linear_places_[e])] += flat_.coefficients[e];
  }
}

void SparseProgram::gather(const Shape& shape, const LaneTape& tape, std::size_t first,
                           std::size_t count, const double* w, double* work) const {
  double* const to = tape.input(0, work);
  for (std::size_t l = 0; l < lanes; ++l) {
    const std::size_t t = first + std::min(l, count - 1);
    const int* const columns = shape.columns.data() + t * shape.variables;
    for (std::size_t i = 0; i < shape.variables; ++i) {
      to[i * lanes + l] = w[columns[i]];
    }
    const double* const data = shape.data.data() + t * shape.numbers;
    for (std::size_t i = 0; i < shape.numbers; ++i) {
      to[(shape.variables + i) * lanes + l] = data[i];
    }
  }
}

bool SparseProgram::values(const VectorXd& w, double& f, VectorXd& c) {
  f = flat_.cost_offset;
  for (int i = 0; i < n_; ++i) {
    f += flat_.cost_coefficients[static_cast<std::size_t>(i)] * w(i);
  }
  for (int r = 0; r < m_; ++r) {
    const auto k = static_cast<std::size_t>(r);
    double sum = flat_.offsets[k];
    for (int e = flat_.row_start[k]; e < flat_.row_start[k + 1]; ++e) {
      sum += flat_.coefficients[static_cast<std::size_t>(e)] *
             w(flat_.columns[static_cast<std::size_t>(e)]);
    }
    c(r) = sum;
  }
  for (std::size_t s = 0; s < flat_.shapes.size(); ++s) {
    const Shape& shape = flat_.shapes[s];
    Compiled& compiled = compiled_[s];
    double* const work = compiled.value_work.data();
    for (std::size_t first = 0; first < shape.rows.size(); first += lanes) {
      const std::size_t count = std::min(lanes, shape.rows.size() - first);
      gather(shape, compiled.values, first, count, w.data(), work);
      compiled.values.evaluate(work);
      const double* const y = compiled.values.output(0, work);
      for (std::size_t l = 0; l < count; ++l) {
        const double value = shape.factors[first + l] * y[l];
        const int row = shape.rows[first + l];
        (row < 0 ? f : c(row)) += value;
      }
    }
  }
  for (int r = 0; r < m_; ++r) {
    const auto k = static_cast<std::size_t>(r);
    c(r) *= row_scale_[k];
    if (slack_[k] >= 0) {
      c(r) -= w(slack_[k]);
    }
  }
  f *= objective_scale_;
  return std::isfinite(f) && std::isfinite(c.sum());
}

bool SparseProgram::derivatives(const VectorXd& w, const VectorXd& lambda, double objective,
                                VectorXd& gradient) {
  const double weight = objective * objective_scale_;
  gradient.setZero();
  for (int i = 0; i < n_; ++i) {
    gradient(i) = weight * flat_.cost_coefficients[static_cast<std::size_t>(i)];
  }
  std::copy(a_linear_.begin(), a_linear_.end(), a_.begin());
  std::fill(h_.begin(), h_.end(), 0.0);
  double check = 0.0;
  for (std::size_t s = 0; s < flat_.shapes.size(); ++s) {
    const Shape& shape = flat_.shapes[s];
    Compiled& compiled = compiled_[s];
    const LaneTape& tape = compiled.derivatives;
    double* const work = compiled.derivative_work.data();
    const std::size_t in_jacobian = compiled.functions.jacobian.size();
    const std::size_t in_hessian = compiled.functions.hessian.size();
    for (std::size_t first = 0; first < shape.rows.size(); first += lanes) {
      const std::size_t count = std::min(lanes, shape.rows.size() - first);
      gather(shape, tape, first, count, w.data(), work);
      double* const mu = tape.input(shape.variables + shape.numbers, work);
      for (std::size_t l = 0; l < lanes; ++l) {
        const std::size_t t = first + std::min(l, count - 1);
        const int row = shape.rows[t];
        mu[l] = shape.factors[t] *
                (row < 0 ? weight : lambda(row) * row_scale_[static_cast<std::size_t>(row)]);
      }
      tape.evaluate(work);
      for (std::size_t e = 0; e < in_jacobian; ++e) {
        const double* const y = tape.output(1 + e, work);
        for (std::size_t l = 0; l < count; ++l) {
          const std::size_t t = first + l;
          const auto place = compiled.jacobian_places[t * in_jacobian + e];
          const double value = shape.factors[t] * y[l];
          if (shape.rows[t] < 0) {
            gradient(place) += weight * value;
          } else {
            a_[static_cast<std::size_t>(place)] += value;
          }
          check += value;
        }
      }
      for (std::size_t e = 0; e < in_hessian; ++e) {
        const double* const y = tape.output(1 + in_jacobian + e, work);
        for (std::size_t l = 0; l < count; ++l) {
          const std::size_t t = first + l;
          const auto place = static_cast<std::size_t>(compiled.hessian_places[t * in_hessian + e]);
          h_[place] += y[l];
          check += y[l];
        }
      }
    }
  }
  for (std::size_t r = 0; r < static_cast<std::size_t>(m_); ++r) {
    for (int e = a_start_[r]; e < a_start_[r + 1] && row_scale_[r] != 1.0; ++e) {
      a_[static_cast<std::size_t>(e)] *= row_scale_[r];
    }
  }
  values_moved_ = false;
  return std::isfinite(check);
}

void SparseProgram::transpose_multiply(const VectorXd& lambda, VectorXd& out) {
  out.setZero();
  for (std::size_t r = 0; r < static_cast<std::size_t>(m_); ++r) {
    const double l = lambda(static_cast<Index>(r));
    for (int e = a_start_[r]; e < a_start_[r + 1]; ++e) {
      out(a_columns_[static_cast<std::size_t>(e)]) += a_[static_cast<std::size_t>(e)] * l;
    }
    if (slack_[r] >= 0) {
      out(slack_[r]) = -l;
    }
  }
}

void SparseProgram::multiply(const VectorXd& dw, const VectorXd& dl, VectorXd& out_w,
                             VectorXd& out_c) {
  transpose_multiply(dl, out_w);
  for (std::size_t e = 0; e < h_.size(); ++e) {
    out_w(h_rows_[e]) += h_[e] * dw(h_columns_[e]);
    if (h_rows_[e] != h_columns_[e]) {
      out_w(h_columns_[e]) += h_[e] * dw(h_rows_[e]);
    }
  }
  for (std::size_t r = 0; r < static_cast<std::size_t>(m_); ++r) {
    double sum = slack_[r] >= 0 ? -dw(slack_[r]) : 0.0;
    for (int e = a_start_[r]; e < a_start_[r + 1]; ++e) {
      sum += a_[static_cast<std::size_t>(e)] * dw(a_columns_[static_cast<std::size_t>(e)]);
    }
    out_c(static_cast<Index>(r)) = sum;
  }
}

VectorXd SparseProgram::start(const std::vector<double>& x) {
  VectorXd w = VectorXd::Zero(variables());
  for (int i = 0; i < n_; ++i) {
    w(i) = std::clamp(x[static_cast<std::size_t>(i)], lower(i), upper(i));
  }
  if (!analyzed_) {
    analyze();
  }
  // Scales: slopes of more than 100 are divided down to that. A cost along stages is the mean of
  // its stages, so that iterations do not depend on their number.
  objective_scale_ = 1.0;
  std::fill(row_scale_.begin(), row_scale_.end(), 1.0);
  VectorXd gradient(variables());
  const VectorXd lambda = VectorXd::Zero(m_);
  if (derivatives(w, lambda, 1.0, gradient)) {
    const double most = gradient.size() > 0 ? gradient.lpNorm<Eigen::Infinity>() : 0.0;
    objective_scale_ = stages_ && !is_quadratic() ? 1.0 / static_cast<double>(stages_->stages())
                       : most > 100.0             ? std::max(100.0 / most, 1e-8)
                                                  : 1.0;
    for (std::size_t r = 0; r < static_cast<std::size_t>(m_); ++r) {
      double slope = 0.0;
      for (int e = a_start_[r]; e < a_start_[r + 1]; ++e) {
        slope = std::max(slope, std::abs(a_[static_cast<std::size_t>(e)]));
      }
      row_scale_[r] =
          slope > 100.0 && !(stages_ && !is_quadratic()) ? std::max(100.0 / slope, 1e-8) : 1.0;
    }
  }
  VectorXd c(m_);
  double f = 0.0;
  (void)values(w, f, c);
  for (int r = 0; r < m_; ++r) {
    const int s = slack_[static_cast<std::size_t>(r)];
    if (s >= 0) {
      w(s) = std::isfinite(c(r)) ? c(r) : 0.0;
    }
  }
  return w;
}

SparseProgram::Fault SparseProgram::find_fault(const VectorXd& w) {
  for (const bool derivative : {false, true}) {
    for (std::size_t s = 0; s < flat_.shapes.size(); ++s) {
      const Shape& shape = flat_.shapes[s];
      Compiled& compiled = compiled_[s];
      const LaneTape& tape = derivative ? compiled.derivatives : compiled.values;
      double* const work =
          derivative ? compiled.derivative_work.data() : compiled.value_work.data();
      for (std::size_t first = 0; first < shape.rows.size(); first += lanes) {
        const std::size_t count = std::min(lanes, shape.rows.size() - first);
        gather(shape, tape, first, count, w.data(), work);
        if (derivative) {
          std::fill_n(tape.input(shape.variables + shape.numbers, work), lanes, 1.0);
        }
        tape.evaluate(work);
        for (std::size_t e = 0; e < tape.outputs(); ++e) {
          for (std::size_t l = 0; l < count; ++l) {
            if (!std::isfinite(tape.output(e, work)[l])) {
              return {shape.rows[first + l], derivative};
            }
          }
        }
      }
    }
  }
  return {};
}

int SparseProgram::find_kink(const VectorXd& w) {
  constexpr double jump = 0.1;
  constexpr int halvings = 20;
  const VectorXd along = (1.0 + w.array().abs()).matrix();
  const VectorXd none = VectorXd::Zero(m_);
  VectorXd ignored = VectorXd::Zero(w.size());
  /// The cost's slopes, then those of the constraints along the way.
  const auto slopes = [&](double place, VectorXd& all) {
    VectorXd gradient = VectorXd::Zero(w.size());
    VectorXd slope = VectorXd::Zero(m_);
    if (!derivatives(w + place * along, none, 1.0, gradient)) {
      return false;
    }
    multiply(along, none, ignored, slope);
    all.resize(w.size() + m_);
    all << gradient, slope;
    return true;
  };
  const auto change = [](double before, double behind) {
    return std::abs(behind - before) / std::max({1e-3, std::abs(before), std::abs(behind)});
  };
  for (const double distance : {1e-6, 1e-4, 1e-2}) {
    VectorXd before, behind, middle;
    if (!slopes(-distance, before) || !slopes(distance, behind)) {
      return -2;
    }
    Index worst = -1;
    double most = jump;
    for (Index i = 0; i < before.size(); ++i) {
      if (const double size = change(before(i), behind(i)); size > most) {
        most = size;
        worst = i;
      }
    }
    if (worst < 0) {
      continue;
    }
    // What is curved changes less over less of the way, a kink by the same.
    double low = -distance;
    double high = distance;
    for (int k = 0; k < halvings; ++k) {
      const double place = 0.5 * (low + high);
      if (!slopes(place, middle)) {
        return -2;
      }
      const bool first =
          change(before(worst), middle(worst)) > change(middle(worst), behind(worst));
      (first ? high : low) = place;
      (first ? behind : before).swap(middle);
    }
    if (change(before(worst), behind(worst)) > 0.5 * most) {
      return worst < w.size() ? -1 : static_cast<int>(worst - w.size());
    }
  }
  return -2;
}

}  // namespace flyball::optimization::detail
