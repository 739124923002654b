#include <algorithm>
#include <cmath>
#include <utility>

#include "optimization/ocp/riccati_dispatch.hpp"
#include "optimization/ocp/stage_program.hpp"

namespace flyball::optimization::detail {

using expression::LaneTape;

namespace {

constexpr std::size_t stage_lanes = LaneTape::lanes;
/// What stands for 0 on the diagonal of an equality's multiplier.
constexpr double stage_regularization = 1e-8;

}  // namespace

StageProgram::StageProgram(StageProblem problem) : problem_(std::move(problem)) {
  const std::size_t stages = problem_.stages;
  const std::size_t n = problem_.states;
  size_ = n + problem_.inputs;
  width_ = size_ <= 4 ? 4 : (size_ + 7) / 8 * 8;
  for (std::size_t kind = 0; kind < problem_.kinds.size(); ++kind) {
    Compiled compiled;
    compiled.values = LaneTape(values_of(problem_.kinds[kind].functions));
    compiled.derivatives = LaneTape(problem_.kinds[kind].functions.tape);
    compiled.value_work.resize(compiled.values.workspace_size());
    compiled.derivative_work.resize(compiled.derivatives.workspace_size());
    make_places(compiled, problem_.kinds[kind]);
    compiled_.push_back(std::move(compiled));
    batches_.push_back({kind, {}});
  }
  first_row_.push_back(0);
  for (std::size_t k = 0; k < stages; ++k) {
    const StageKind& kind = problem_.kinds[problem_.kind[k]];
    batches_[problem_.kind[k]].stages.push_back(k);
    const std::size_t before = (kind.has_dynamics ? n : 0) + 1;
    first_row_.push_back(first_row_.back() + kind.functions.rows - before);
  }
  const std::size_t rows = first_row_.back();
  std::ptrdiff_t next = static_cast<std::ptrdiff_t>(stages * size_);
  for (std::size_t r = 0; r < rows; ++r) {
    slack_.push_back(problem_.row_lower[r] < problem_.row_upper[r] ? next++ : -1);
  }
  lower.resize(next);
  upper.resize(next);
  constraint_count = static_cast<Eigen::Index>(defects() + rows);
  fixed_.resize(stages * size_);
  H_.assign(stages * size_ * width_, 0.0);
  AB_.assign(stages * n * width_, 0.0);
  G_.assign(rows * width_, 0.0);
  P_.assign(stages * n * width_, 0.0);
  E_.assign(stages * n * width_, 0.0);
  L_.assign(stages * size_ * width_, 0.0);
  pivots_.assign(stages * size_, 0.0);
  scratch_.assign((size_ + 1) * 3 * width_, 0.0);
  weight_.assign(rows, 0.0);
  weighted_.assign(rows, 0.0);
  D_.assign(stages * n, 0.0);
  p_.assign(stages * n, 0.0);
  g_.assign(stages * size_, 0.0);
  row_offset_.assign(rows, 0.0);
  slack_diagonal_.setZero(static_cast<Eigen::Index>(rows));
  refresh();
}

void StageProgram::make_places(Compiled& compiled, const StageKind& kind) const {
  const std::size_t n = problem_.states;
  const expression::Lagrangian& f = kind.functions;
  const std::size_t cost_row = kind.has_dynamics ? n : 0;
  for (std::size_t e = 0; e < f.jacobian.size(); ++e) {
    const std::size_t row = f.jacobian[e].row;
    const std::size_t column = f.jacobian[e].column;
    const std::size_t output = f.rows + e;
    const bool is_fixed = compiled.derivatives.is_fixed(output);
    if (row < cost_row) {
      compiled.dynamics.push_back({output, row * width_ + column, 0, is_fixed});
    } else if (row == cost_row) {
      compiled.cost.push_back({output, column, 0, false});
    } else {
      compiled.rows.push_back({output, (row - cost_row - 1) * width_ + column, 0, is_fixed});
    }
  }
  for (std::size_t e = 0; e < f.hessian.size(); ++e) {
    const std::size_t output = f.rows + f.jacobian.size() + e;
    const std::size_t row = f.hessian[e].row;
    const std::size_t column = f.hessian[e].column;
    compiled.hessian.push_back({output, row * width_ + column, column * width_ + row, false});
  }
}

void StageProgram::refresh() {
  for (std::size_t k = 0; k < problem_.stages; ++k) {
    for (std::size_t i = 0; i < size_; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const auto column = static_cast<Eigen::Index>(k);
      lower(static_cast<Eigen::Index>(k * size_ + i)) = problem_.lower(row, column);
      upper(static_cast<Eigen::Index>(k * size_ + i)) = problem_.upper(row, column);
      fixed_[k * size_ + i] = problem_.lower(row, column) == problem_.upper(row, column) ? 1 : 0;
    }
  }
  for (std::size_t r = 0; r < slack_.size(); ++r) {
    if (slack_[r] >= 0) {
      lower(slack_[r]) = problem_.row_lower[r];
      upper(slack_[r]) = problem_.row_upper[r];
    } else {
      row_offset_[r] = problem_.row_lower[r];
    }
  }
  const std::span<const double> parameters(problem_.parameters.data(),
                                           static_cast<std::size_t>(problem_.parameters.size()));
  for (Compiled& kind : compiled_) {
    kind.values.prepare(parameters, kind.value_work.data());
    kind.derivatives.prepare(parameters, kind.derivative_work.data());
  }
  written_ = false;
}

void StageProgram::gather(const Compiled& /*kind*/, const LaneTape& tape, const std::size_t* stages,
                          std::size_t count, const double* w, double* work) const {
  double* const to = tape.input(0, work);
  const auto numbers = static_cast<std::size_t>(problem_.data.rows());
  for (std::size_t l = 0; l < stage_lanes; ++l) {
    const std::size_t k = stages[std::min(l, count - 1)];
    for (std::size_t i = 0; i < size_; ++i) {
      to[i * stage_lanes + l] = w[k * size_ + i];
    }
    const double* const data = problem_.data.data() + k * numbers;
    for (std::size_t i = 0; i < numbers; ++i) {
      to[(size_ + i) * stage_lanes + l] = data[i];
    }
  }
}

bool StageProgram::values(const Eigen::VectorXd& w, double& f, Eigen::VectorXd& c) {
  const std::size_t n = problem_.states;
  double sum = 0.0;
  double* const out = c.data();
  double* const out_rows = c.data() + defects();
  for (const Batch& batch : batches_) {
    Compiled& kind = compiled_[batch.kind];
    const bool dynamics = problem_.kinds[batch.kind].has_dynamics;
    const std::size_t cost_row = dynamics ? n : 0;
    double* const work = kind.value_work.data();
    for (std::size_t first = 0; first < batch.stages.size(); first += stage_lanes) {
      const std::size_t count = std::min(stage_lanes, batch.stages.size() - first);
      const std::size_t* const stages = batch.stages.data() + first;
      gather(kind, kind.values, stages, count, w.data(), work);
      kind.values.evaluate(work);
      for (std::size_t i = 0; i < cost_row; ++i) {
        const double* const y = kind.values.output(i, work);
        for (std::size_t l = 0; l < count; ++l) {
          out[stages[l] * n + i] = y[l] - w.data()[(stages[l] + 1) * size_ + i];
        }
      }
      const double* const cost = kind.values.output(cost_row, work);
      for (std::size_t l = 0; l < count; ++l) {
        sum += cost[l];
      }
      for (std::size_t i = cost_row + 1; i < kind.values.outputs(); ++i) {
        const double* const y = kind.values.output(i, work);
        for (std::size_t l = 0; l < count; ++l) {
          out_rows[first_row_[stages[l]] + i - cost_row - 1] = y[l];
        }
      }
    }
  }
  for (std::size_t r = 0; r < slack_.size(); ++r) {
    out_rows[r] -= slack_[r] >= 0 ? w(slack_[r]) : row_offset_[r];
  }
  f = sum * problem_.objective_scale;
  return std::isfinite(f) && std::isfinite(c.sum());
}

bool StageProgram::derivatives(const Eigen::VectorXd& w, const Eigen::VectorXd& lambda,
                               double objective, Eigen::VectorXd& gradient) {
  const std::size_t n = problem_.states;
  const double weight = objective * problem_.objective_scale;
  gradient.setZero();
  double check = 0.0;
  const double* const row_multipliers = lambda.data() + defects();
  for (const Batch& batch : batches_) {
    Compiled& kind = compiled_[batch.kind];
    const LaneTape& tape = kind.derivatives;
    const std::size_t cost_row = problem_.kinds[batch.kind].has_dynamics ? n : 0;
    const std::size_t function_rows = problem_.kinds[batch.kind].functions.rows;
    double* const work = kind.derivative_work.data();
    const std::size_t first_weight = size_ + static_cast<std::size_t>(problem_.data.rows());
    for (std::size_t first = 0; first < batch.stages.size(); first += stage_lanes) {
      const std::size_t count = std::min(stage_lanes, batch.stages.size() - first);
      const std::size_t* const stages = batch.stages.data() + first;
      gather(kind, tape, stages, count, w.data(), work);
      double* const mu = tape.input(first_weight, work);
      for (std::size_t l = 0; l < stage_lanes; ++l) {
        const std::size_t k = stages[std::min(l, count - 1)];
        for (std::size_t i = 0; i < cost_row; ++i) {
          mu[i * stage_lanes + l] = lambda.data()[k * n + i];
        }
        mu[cost_row * stage_lanes + l] = weight;
        for (std::size_t i = cost_row + 1; i < function_rows; ++i) {
          mu[i * stage_lanes + l] = row_multipliers[first_row_[k] + i - cost_row - 1];
        }
      }
      tape.evaluate(work);
      for (const Place& place : kind.dynamics) {
        if (place.fixed && written_) {
          continue;
        }
        const double* const y = tape.output(place.output, work);
        for (std::size_t l = 0; l < count; ++l) {
          AB_[stages[l] * n * width_ + place.where] = y[l];
          check += y[l];
        }
      }
      for (const Place& place : kind.cost) {
        const double* const y = tape.output(place.output, work);
        for (std::size_t l = 0; l < count; ++l) {
          gradient.data()[stages[l] * size_ + place.where] = weight * y[l];
          check += y[l];
        }
      }
      for (const Place& place : kind.rows) {
        if (place.fixed && written_) {
          continue;
        }
        const double* const y = tape.output(place.output, work);
        for (std::size_t l = 0; l < count; ++l) {
          G_[first_row_[stages[l]] * width_ + place.where] = y[l];
          check += y[l];
        }
      }
      for (const Place& place : kind.hessian) {
        const double* const y = tape.output(place.output, work);
        for (std::size_t l = 0; l < count; ++l) {
          double* const block = H_.data() + stages[l] * size_ * width_;
          block[place.where] = y[l];
          block[place.mirror] = y[l];
          check += y[l];
        }
      }
    }
  }
  written_ = true;
  return std::isfinite(check);
}

void StageProgram::multiply(const Eigen::VectorXd& dw, const Eigen::VectorXd& dl,
                            Eigen::VectorXd& out_w, Eigen::VectorXd& out_c) {
  const std::size_t n = problem_.states;
  transpose_multiply(dl, out_w);
  for (std::size_t k = 0; k < problem_.stages; ++k) {
    const double* const z = dw.data() + k * size_;
    double* const to = out_w.data() + k * size_;
    const double* const H = H_.data() + k * size_ * width_;
    for (std::size_t i = 0; i < size_; ++i) {
      double sum = 0.0;
      for (std::size_t j = 0; j < size_; ++j) {
        sum += H[i * width_ + j] * z[j];
      }
      to[i] += sum;
    }
    if (k + 1 < problem_.stages) {
      const double* const AB = AB_.data() + k * n * width_;
      for (std::size_t i = 0; i < n; ++i) {
        double sum = -z[size_ + i];
        for (std::size_t j = 0; j < size_; ++j) {
          sum += AB[i * width_ + j] * z[j];
        }
        out_c.data()[k * n + i] = sum;
      }
    }
    for (std::size_t r = first_row_[k]; r < first_row_[k + 1]; ++r) {
      double sum = slack_[r] >= 0 ? -dw(slack_[r]) : 0.0;
      for (std::size_t j = 0; j < size_; ++j) {
        sum += G_[r * width_ + j] * z[j];
      }
      out_c.data()[defects() + r] = sum;
    }
  }
}

void StageProgram::transpose_multiply(const Eigen::VectorXd& lambda, Eigen::VectorXd& out) {
  const std::size_t n = problem_.states;
  const double* const row_multipliers = lambda.data() + defects();
  for (std::size_t k = 0; k < problem_.stages; ++k) {
    double* const to = out.data() + k * size_;
    for (std::size_t j = 0; j < size_; ++j) {
      to[j] = k > 0 && j < n ? -lambda.data()[(k - 1) * n + j] : 0.0;
    }
    if (k + 1 < problem_.stages) {
      const double* const AB = AB_.data() + k * n * width_;
      for (std::size_t i = 0; i < n; ++i) {
        const double l = lambda.data()[k * n + i];
        for (std::size_t j = 0; j < size_; ++j) {
          to[j] += AB[i * width_ + j] * l;
        }
      }
    }
    for (std::size_t r = first_row_[k]; r < first_row_[k + 1]; ++r) {
      for (std::size_t j = 0; j < size_; ++j) {
        to[j] += G_[r * width_ + j] * row_multipliers[r];
      }
      if (slack_[r] >= 0) {
        out(slack_[r]) = -row_multipliers[r];
      }
    }
  }
}

bool StageProgram::factor(const Eigen::VectorXd& diagonal, const Eigen::VectorXd& D,
                          bool with_hessian) {
  const std::size_t n = problem_.states;
  bool soft = false;
  for (std::size_t i = 0; i < defects(); ++i) {
    soft = soft || D.data()[i] > 0.0;
  }
  for (std::size_t i = 0; i < defects(); ++i) {
    D_[i] = std::max(D.data()[i], stage_regularization);
  }
  for (std::size_t r = 0; r < slack_.size(); ++r) {
    const double d = D.data()[defects() + r];
    if (slack_[r] >= 0) {
      const double s = diagonal(slack_[r]);
      if (!(s > 0.0)) {
        return false;
      }
      slack_diagonal_(static_cast<Eigen::Index>(r)) = s;
      weight_[r] = s / (1.0 + d * s);
    } else {
      weight_[r] = 1.0 / std::max(d, stage_regularization);
    }
  }
  StageSystem system;
  system.stages = problem_.stages;
  system.states = n;
  system.inputs = problem_.inputs;
  system.width = width_;
  system.H = with_hessian ? H_.data() : nullptr;
  system.diagonal = diagonal.data();
  system.AB = AB_.data();
  system.G = G_.data();
  system.weight = weight_.data();
  system.first_row = first_row_.data();
  system.fixed = fixed_.data();
  system.D = D_.data();
  system.soft = soft;
  system.P = P_.data();
  system.E = E_.data();
  system.L = L_.data();
  system.pivots = pivots_.data();
  system.scratch = scratch_.data();
  system_ = system;
  return riccati_kernels().factor(system_);
}

void StageProgram::solve(const Eigen::VectorXd& rw, const Eigen::VectorXd& rc, Eigen::VectorXd& dw,
                         Eigen::VectorXd& dl) {
  const double* const rc_rows = rc.data() + defects();
  for (std::size_t r = 0; r < slack_.size(); ++r) {
    const double e =
        slack_[r] >= 0 ? rc_rows[r] + rw(slack_[r]) / slack_diagonal_(static_cast<Eigen::Index>(r))
                       : rc_rows[r];
    weighted_[r] = weight_[r] * e;
  }
  StageVectors vectors;
  vectors.h = rw.data();
  vectors.b = rc.data();
  vectors.e = weighted_.data();
  vectors.dz = dw.data();
  vectors.dl = dl.data();
  vectors.p = p_.data();
  vectors.g = g_.data();
  riccati_kernels().solve(system_, vectors);
  for (std::size_t k = 0; k < problem_.stages; ++k) {
    const double* const z = dw.data() + k * size_;
    for (std::size_t r = first_row_[k]; r < first_row_[k + 1]; ++r) {
      double sum = 0.0;
      for (std::size_t j = 0; j < size_; ++j) {
        sum += G_[r * width_ + j] * z[j];
      }
      const double multiplier = weight_[r] * sum + weighted_[r];
      dl.data()[defects() + r] = multiplier;
      if (slack_[r] >= 0) {
        dw(slack_[r]) =
            (multiplier - rw(slack_[r])) / slack_diagonal_(static_cast<Eigen::Index>(r));
      }
    }
  }
}

Eigen::VectorXd StageProgram::start(const Eigen::MatrixXd& z) {
  Eigen::VectorXd w = Eigen::VectorXd::Zero(variables());
  w.head(static_cast<Eigen::Index>(problem_.stages * size_)) =
      Eigen::Map<const Eigen::VectorXd>(z.data(), z.size());
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(problem_.stages * size_); ++i) {
    w(i) = lower(i) == upper(i) ? lower(i) : w(i);
  }
  Eigen::VectorXd c(constraints());
  double f = 0.0;
  (void)values(w, f, c);
  for (std::size_t r = 0; r < slack_.size(); ++r) {
    if (slack_[r] >= 0) {
      const double g = c(static_cast<Eigen::Index>(defects() + r));
      w(slack_[r]) = std::isfinite(g) ? g : 0.0;
    }
  }
  return w;
}

StageProgram::Fault StageProgram::find_fault(const Eigen::VectorXd& w) {
  for (const Batch& batch : batches_) {
    Compiled& kind = compiled_[batch.kind];
    double* const work = kind.value_work.data();
    for (std::size_t first = 0; first < batch.stages.size(); first += stage_lanes) {
      const std::size_t count = std::min(stage_lanes, batch.stages.size() - first);
      gather(kind, kind.values, batch.stages.data() + first, count, w.data(), work);
      kind.values.evaluate(work);
      for (std::size_t l = 0; l < count; ++l) {
        for (std::size_t i = 0; i < kind.values.outputs(); ++i) {
          if (!std::isfinite(kind.values.output(i, work)[l])) {
            return {batch.stages[first + l], i, true, false};
          }
        }
      }
    }
  }
  return find_derivative_fault(w);
}

/// Rows one by one: of the Hessian each has its own part.
StageProgram::Fault StageProgram::find_derivative_fault(const Eigen::VectorXd& w) {
  for (const Batch& batch : batches_) {
    Compiled& kind = compiled_[batch.kind];
    const LaneTape& tape = kind.derivatives;
    const expression::Lagrangian& functions = problem_.kinds[batch.kind].functions;
    double* const work = kind.derivative_work.data();
    const std::size_t first_weight = size_ + static_cast<std::size_t>(problem_.data.rows());
    for (std::size_t first = 0; first < batch.stages.size(); first += stage_lanes) {
      const std::size_t count = std::min(stage_lanes, batch.stages.size() - first);
      gather(kind, tape, batch.stages.data() + first, count, w.data(), work);
      for (std::size_t row = 0; row < functions.rows; ++row) {
        double* const mu = tape.input(first_weight, work);
        std::fill_n(mu, functions.rows * stage_lanes, 0.0);
        std::fill_n(mu + row * stage_lanes, stage_lanes, 1.0);
        tape.evaluate(work);
        for (std::size_t e = functions.rows; e < tape.outputs(); ++e) {
          const std::size_t entry = e - functions.rows;
          if (entry < functions.jacobian.size() && functions.jacobian[entry].row != row) {
            continue;
          }
          const double* const y = tape.output(e, work);
          for (std::size_t l = 0; l < count; ++l) {
            if (!std::isfinite(y[l])) {
              return {batch.stages[first + l], row, true, true};
            }
          }
        }
      }
    }
  }
  return {};
}

}  // namespace flyball::optimization::detail
