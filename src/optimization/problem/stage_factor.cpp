#include <algorithm>
#include <cmath>

#include "optimization/ocp/riccati_dispatch.hpp"
#include "optimization/problem/stage_factor.hpp"

namespace flyball::optimization::detail {

namespace {

constexpr std::size_t most_variables = 24;
constexpr std::size_t fewest_stages = 4;

}  // namespace

bool StageFactor::find(const SparsePattern& pattern) {
  return find_levels(pattern) && find_roles(pattern) && lay_out(pattern);
}

/// Breadth first over rows and the Hessian, from the fixed variables that come first.
bool StageFactor::find_levels(const SparsePattern& p) {
  const auto n = static_cast<std::size_t>(p.variables);
  std::vector<int> start(n + 1, 0);
  for (const int column : p.columns) {
    ++start[static_cast<std::size_t>(column) + 1];
  }
  for (std::size_t i = 0; i < n; ++i) {
    start[i + 1] += start[i];
  }
  std::vector<int> rows_of(p.columns.size());
  std::vector<int> next(start.begin(), start.end() - 1);
  for (int r = 0; r < p.rows; ++r) {
    for (int e = p.row_start[static_cast<std::size_t>(r)];
         e < p.row_start[static_cast<std::size_t>(r) + 1]; ++e) {
      const auto column = static_cast<std::size_t>(p.columns[static_cast<std::size_t>(e)]);
      rows_of[static_cast<std::size_t>(next[column]++)] = r;
    }
  }
  const auto first = std::find(p.fixed.begin(), p.fixed.end(), 1);
  if (first == p.fixed.end()) {
    return false;
  }
  level_.assign(n, -1);
  std::vector<int> queue{static_cast<int>(first - p.fixed.begin())};
  std::vector<unsigned char> row_seen(static_cast<std::size_t>(p.rows), 0);
  level_[static_cast<std::size_t>(queue[0])] = 0;
  // Level 0: fixed variables that share rows with fixed variables of it.
  for (std::size_t at = 0; at < queue.size(); ++at) {
    const auto i = static_cast<std::size_t>(queue[at]);
    for (int q = start[i]; q < start[i + 1]; ++q) {
      const auto r = static_cast<std::size_t>(rows_of[static_cast<std::size_t>(q)]);
      for (int e = p.row_start[r]; e < p.row_start[r + 1]; ++e) {
        const int j = p.columns[static_cast<std::size_t>(e)];
        if (p.fixed[static_cast<std::size_t>(j)] != 0 && level_[static_cast<std::size_t>(j)] < 0) {
          level_[static_cast<std::size_t>(j)] = 0;
          queue.push_back(j);
        }
      }
    }
  }
  for (std::size_t at = 0; at < queue.size(); ++at) {
    const auto i = static_cast<std::size_t>(queue[at]);
    for (int q = start[i]; q < start[i + 1]; ++q) {
      const auto r = static_cast<std::size_t>(rows_of[static_cast<std::size_t>(q)]);
      if (row_seen[r] != 0 || p.equality[r] == 0) {
        continue;
      }
      row_seen[r] = 1;
      for (int e = p.row_start[r]; e < p.row_start[r + 1]; ++e) {
        const int j = p.columns[static_cast<std::size_t>(e)];
        if (level_[static_cast<std::size_t>(j)] < 0) {
          level_[static_cast<std::size_t>(j)] = level_[i] + 1;
          queue.push_back(j);
        }
      }
    }
  }
  return queue.size() == n || join_by_inequalities(p, queue.size());
}

/// What only inequalities reach (bounds of what a cost adds up, what a limit may be missed by) is
/// an input of the stage whose states and inputs they hold it to.
/// @param known  How many variables have levels.
bool StageFactor::join_by_inequalities(const SparsePattern& p, std::size_t known) {
  std::vector<unsigned char> is_state(level_.size(), 0);
  const auto each_of = [&](std::size_t row, auto&& see) {
    for (int e = p.row_start[row]; e < p.row_start[row + 1]; ++e) {
      see(static_cast<std::size_t>(p.columns[static_cast<std::size_t>(e)]));
    }
  };
  const auto rows = static_cast<std::size_t>(p.rows);
  for (std::size_t r = 0; r < rows; ++r) {
    int high = -1;
    each_of(r, [&](std::size_t j) { high = std::max(high, level_[j]); });
    each_of(r, [&](std::size_t j) {
      is_state[j] = p.equality[r] != 0 && level_[j] == high - 1 ? 1 : is_state[j];
    });
  }
  for (bool moved = true; moved && known < level_.size();) {
    moved = false;
    for (std::size_t r = 0; r < rows; ++r) {
      int level = -1;
      each_of(r, [&](std::size_t j) {
        level = std::max(level, level_[j] < 0 ? -1 : level_[j] + (is_state[j] != 0 ? 1 : 0));
      });
      each_of(r, [&](std::size_t j) {
        if (level >= 0 && level_[j] < 0) {
          level_[j] = level;
          ++known;
          moved = true;
        }
      });
    }
  }
  return known == level_.size();
}

/// A variable that rows to the level after its own need is a state, others are inputs of the stage
/// before; of the last level the outputs of its rows are states.
bool StageFactor::find_roles(const SparsePattern& p) {
  const auto n = static_cast<std::size_t>(p.variables);
  const int last = *std::max_element(level_.begin(), level_.end());
  std::vector<unsigned char> is_state(n, 0);
  std::vector<int> row_level(static_cast<std::size_t>(p.rows), -1);  // the lower one, of a bridge
  for (std::size_t r = 0; r < row_level.size(); ++r) {
    int low = last;
    int high = 0;
    for (int e = p.row_start[r]; e < p.row_start[r + 1]; ++e) {
      const int level = level_[static_cast<std::size_t>(p.columns[static_cast<std::size_t>(e)])];
      low = std::min(low, level);
      high = std::max(high, level);
    }
    if (high == low + 1 && p.equality[r] != 0) {
      row_level[r] = low;
      for (int e = p.row_start[r]; e < p.row_start[r + 1]; ++e) {
        const auto j = static_cast<std::size_t>(p.columns[static_cast<std::size_t>(e)]);
        is_state[j] = level_[j] == low ? 1 : is_state[j];
      }
    } else if (high > low + 1) {
      return false;
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    is_state[i] = level_[i] == 0 ? 1 : is_state[i];
  }
  // The output of a row: the state of the level above; at the last one the largest coefficient.
  output_.assign(static_cast<std::size_t>(p.rows), -1);
  scale_.assign(static_cast<std::size_t>(p.rows), 1.0);
  std::vector<unsigned char> taken(n, 0);
  for (std::size_t r = 0; r < row_level.size(); ++r) {
    if (row_level[r] < 0) {
      continue;
    }
    double most = 0.0;
    for (int e = p.row_start[r]; e < p.row_start[r + 1]; ++e) {
      const auto at = static_cast<std::size_t>(e);
      const auto j = static_cast<std::size_t>(p.columns[at]);
      if (level_[j] != row_level[r] + 1 || (level_[j] < last && is_state[j] == 0)) {
        continue;
      }
      if (level_[j] < last && (output_[r] >= 0 || p.is_linear[at] == 0)) {
        return false;  // it gives two states, or one that is not linear in it
      }
      const double coefficient = p.is_linear[at] != 0 ? p.linear[at] : 0.0;
      if (std::abs(coefficient) > most && taken[j] == 0) {
        most = std::abs(coefficient);
        output_[r] = static_cast<int>(j);
        scale_[r] = -1.0 / coefficient;
      }
    }
    if (output_[r] < 0) {
      return false;
    }
    taken[static_cast<std::size_t>(output_[r])] = 1;
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (level_[i] > 0 && level_[i] < last && is_state[i] != taken[i]) {
      return false;
    }
    if (level_[i] > 0 && taken[i] == 0) {
      --level_[i];  // an input belongs to the stage before
    }
  }
  is_state.swap(taken);
  for (std::size_t i = 0; i < n; ++i) {
    is_state[i] = level_[i] == 0 && taken[i] != 0 ? 1 : is_state[i];
  }
  fixed_.swap(is_state);  // kept for the layout
  return static_cast<std::size_t>(last) + 1 >= fewest_stages;
}

bool StageFactor::lay_out(const SparsePattern& p) {
  const auto n = static_cast<std::size_t>(p.variables);
  const std::vector<unsigned char> is_state = fixed_;
  const auto stages = static_cast<std::size_t>(*std::max_element(level_.begin(), level_.end())) + 1;
  std::vector<std::size_t> states(stages, 0);
  std::vector<std::size_t> inputs(stages, 0);
  for (std::size_t i = 0; i < n; ++i) {
    ++(is_state[i] != 0 ? states : inputs)[static_cast<std::size_t>(level_[i])];
  }
  const std::size_t nx = *std::max_element(states.begin(), states.end());
  const std::size_t nu = *std::max_element(inputs.begin(), inputs.end());
  const std::size_t size = nx + nu;
  if (size > most_variables || stages * size > 3 * n + 64) {
    return false;
  }
  const std::size_t width = size <= 4 ? 4 : (size + 7) / 8 * 8;
  if (stages * size * width > std::size_t{1} << 31U) {
    return false;
  }
  const auto move = [](std::size_t from, std::size_t to, double by) {
    return Move{static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to), by};
  };
  hessian_moves_.reserve(2 * p.hessian_rows.size());
  defect_moves_.reserve(p.columns.size());
  // Places; what is not there is fixed.
  fixed_.assign(stages * size, 1);
  place_.assign(n, 0);
  std::fill(states.begin(), states.end(), 0);
  std::fill(inputs.begin(), inputs.end(), 0);
  for (std::size_t i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(level_[i]);
    const std::size_t at = is_state[i] != 0 ? states[k]++ : nx + inputs[k]++;
    place_[i] = k * size + at;
    fixed_[place_[i]] = p.fixed[i];
  }
  for (std::size_t e = 0; e < p.hessian_rows.size(); ++e) {
    const auto i = static_cast<std::size_t>(p.hessian_rows[e]);
    const auto j = static_cast<std::size_t>(p.hessian_columns[e]);
    if (level_[i] != level_[j]) {
      return false;
    }
    const std::size_t k = static_cast<std::size_t>(level_[i]) * size;
    const std::size_t row = place_[i] - k;
    const std::size_t column = place_[j] - k;
    hessian_moves_.push_back(move(e, (k + row) * width + column, 1.0));
    if (row != column) {
      hessian_moves_.push_back(move(e, (k + column) * width + row, 1.0));
    }
  }
  // Rows between stages, and those of one.
  const auto rows = static_cast<std::size_t>(p.rows);
  row_place_.assign(rows, 0);
  first_row_.assign(stages + 1, 0);
  std::vector<std::size_t> stage_of(rows, 0);
  for (std::size_t r = 0; r < rows; ++r) {
    int stage = -1;
    for (int e = p.row_start[r]; e < p.row_start[r + 1]; ++e) {
      const int j = p.columns[static_cast<std::size_t>(e)];
      if (j == output_[r]) {
        continue;
      }
      if (stage >= 0 && stage != level_[static_cast<std::size_t>(j)]) {
        return false;
      }
      stage = level_[static_cast<std::size_t>(j)];
    }
    if (output_[r] >= 0) {
      const int next = level_[static_cast<std::size_t>(output_[r])];
      if (stage >= 0 && stage != next - 1) {
        return false;
      }
      const std::size_t k = static_cast<std::size_t>(next) - 1;
      stage_of[r] = k;
      row_place_[r] = k * nx + place_[static_cast<std::size_t>(output_[r])] -
                      static_cast<std::size_t>(next) * size;
    } else {
      stage_of[r] = static_cast<std::size_t>(std::max(stage, 0));
      ++first_row_[stage_of[r] + 1];
    }
  }
  for (std::size_t k = 0; k < stages; ++k) {
    first_row_[k + 1] += first_row_[k];
  }
  std::vector<std::size_t> next(first_row_.begin(), first_row_.end() - 1);
  for (std::size_t r = 0; r < rows; ++r) {
    const bool between = output_[r] >= 0;
    if (!between) {
      row_place_[r] = next[stage_of[r]]++;
    }
    for (int e = p.row_start[r]; e < p.row_start[r + 1]; ++e) {
      const auto at = static_cast<std::size_t>(e);
      const int j = p.columns[at];
      if (j == output_[r]) {
        continue;
      }
      const std::size_t column = place_[static_cast<std::size_t>(j)] - stage_of[r] * size;
      (between ? defect_moves_ : row_moves_)
          .push_back(move(at, row_place_[r] * width + column, scale_[r]));
    }
  }
  H_.assign(stages * size * width, 0.0);
  AB_.assign(stages * nx * width, 0.0);
  G_.assign(first_row_.back() * width, 0.0);
  P_.assign(stages * nx * width, 0.0);
  E_.assign(stages * nx * width, 0.0);
  L_.assign(stages * size * width, 0.0);
  pivots_.assign(stages * size, 0.0);
  scratch_.assign((size + 1) * 3 * width, 0.0);
  diagonal_.assign(stages * size, 1.0);
  D_.assign(stages * nx, 1.0);
  weight_.assign(first_row_.back(), 0.0);
  weighted_.assign(first_row_.back(), 0.0);
  h_.assign(stages * size, 0.0);
  b_.assign(stages * nx, 0.0);
  dz_.assign(stages * size, 0.0);
  dl_.assign(stages * nx, 0.0);
  p_.assign(stages * nx, 0.0);
  g_.assign(stages * size, 0.0);
  system_.stages = stages;
  system_.states = nx;
  system_.inputs = nu;
  system_.width = width;
  system_.diagonal = diagonal_.data();
  system_.AB = AB_.data();
  system_.G = G_.data();
  system_.weight = weight_.data();
  system_.first_row = first_row_.data();
  system_.fixed = fixed_.data();
  system_.D = D_.data();
  system_.P = P_.data();
  system_.E = E_.data();
  system_.L = L_.data();
  system_.pivots = pivots_.data();
  system_.scratch = scratch_.data();
  return true;
}

void StageFactor::set_values(const std::vector<double>& hessian, const std::vector<double>& rows) {
  for (const Move& move : hessian_moves_) {
    H_[move.to] = hessian[move.from];
  }
  for (const Move& move : defect_moves_) {
    AB_[move.to] = move.factor * rows[move.from];
  }
  for (const Move& move : row_moves_) {
    G_[move.to] = rows[move.from];
  }
}

bool StageFactor::factor(const double* diagonal, const double* D, bool soft, bool with_hessian) {
  for (std::size_t i = 0; i < place_.size(); ++i) {
    diagonal_[place_[i]] = diagonal[i];
  }
  for (std::size_t r = 0; r < row_place_.size(); ++r) {
    if (output_[r] >= 0) {
      D_[row_place_[r]] = D[r] * scale_[r] * scale_[r];
    } else {
      weight_[row_place_[r]] = 1.0 / D[r];
    }
  }
  system_.soft = soft;
  system_.H = with_hessian ? H_.data() : nullptr;
  return riccati_kernels().factor(system_);
}

void StageFactor::solve(const double* rw, const double* rc, double* dw, double* dl) {
  for (std::size_t i = 0; i < place_.size(); ++i) {
    h_[place_[i]] = rw[i];
  }
  for (std::size_t r = 0; r < row_place_.size(); ++r) {
    if (output_[r] >= 0) {
      b_[row_place_[r]] = scale_[r] * rc[r];
    } else {
      weighted_[row_place_[r]] = weight_[row_place_[r]] * rc[r];
    }
  }
  StageVectors vectors;
  vectors.h = h_.data();
  vectors.b = b_.data();
  vectors.e = weighted_.data();
  vectors.dz = dz_.data();
  vectors.dl = dl_.data();
  vectors.p = p_.data();
  vectors.g = g_.data();
  riccati_kernels().solve(system_, vectors);
  for (std::size_t i = 0; i < place_.size(); ++i) {
    dw[i] = dz_[place_[i]];
  }
  const std::size_t size = system_.states + system_.inputs;
  for (std::size_t k = 0; k < system_.stages; ++k) {
    for (std::size_t r = first_row_[k]; r < first_row_[k + 1]; ++r) {
      double sum = 0.0;
      for (std::size_t j = 0; j < size; ++j) {
        sum += G_[r * system_.width + j] * dz_[k * size + j];
      }
      weighted_[r] += weight_[r] * sum;
    }
  }
  for (std::size_t r = 0; r < row_place_.size(); ++r) {
    dl[r] = output_[r] >= 0 ? scale_[r] * dl_[row_place_[r]] : weighted_[row_place_[r]];
  }
}

bool StageFactor::roll(const double* w, const double* lower, const double* upper, double* side,
                       double* dw) {
  constexpr double slack = 1e-9;
  const std::size_t n = system_.states;
  const std::size_t size = n + system_.inputs;
  const std::size_t width = system_.width;
  if (variable_.empty()) {
    variable_.assign(fixed_.size(), -1);
    for (std::size_t i = 0; i < place_.size(); ++i) {
      variable_[place_[i]] = static_cast<int>(i);
    }
  }
  bool kept = false;
  // The step of a place within its bounds: of a variable that is at none of them yet.
  const auto within = [&](std::size_t at, double step) {
    const int i = variable_[at];
    if (fixed_[at] != 0 || i < 0 || side[i] != 0.0) {
      return step;
    }
    if (w[i] + step < lower[i] - slack) {
      side[i] = -1.0;
      kept = true;
      return lower[i] - w[i];
    }
    if (w[i] + step > upper[i] + slack) {
      side[i] = 1.0;
      kept = true;
      return upper[i] - w[i];
    }
    return step;
  };
  const auto by_feedback = [&](std::size_t k, std::size_t j) {
    const double* const L = L_.data() + (k * size + j) * width;
    double sum = -g_[k * size + j];
    for (std::size_t a = 0; a < j; ++a) {
      sum -= L[a] * dz_[k * size + a];
    }
    return fixed_[k * size + j] != 0 ? 0.0 : sum;
  };
  for (std::size_t j = 0; j < n; ++j) {
    dz_[j] = within(j, by_feedback(0, j));
  }
  for (std::size_t k = 0; k < system_.stages; ++k) {
    double* const z = dz_.data() + k * size;
    for (std::size_t j = n; j < size; ++j) {
      z[j] = within(k * size + j, by_feedback(k, j));
    }
    if (k + 1 == system_.stages) {
      break;
    }
    const auto next = [&](std::size_t i) {
      double sum = b_[k * n + i];
      for (std::size_t a = 0; a < size; ++a) {
        sum += AB_[(k * n + i) * width + a] * z[a];
      }
      return sum;
    };
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t at = (k + 1) * size + i;
      const double free = next(i);
      const double bounded = within(at, free);
      for (std::size_t j = n; j < size && bounded != free; ++j) {
        const int v = variable_[k * size + j];
        const double slope = AB_[(k * n + i) * width + j];
        if (fixed_[k * size + j] == 0 && v >= 0 && side[v] == 0.0 && slope != 0.0) {
          z[j] = within(k * size + j, z[j] + (bounded - free) / slope);
          break;
        }
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      z[size + i] = fixed_[(k + 1) * size + i] != 0 ? 0.0 : next(i);
    }
  }
  for (std::size_t i = 0; i < place_.size(); ++i) {
    dw[i] = dz_[place_[i]];
  }
  return kept;
}

}  // namespace flyball::optimization::detail
