#include <algorithm>
#include <array>
#include <cmath>

#include "identification/record_noise.hpp"
#include "identification/soft_loss.hpp"
#include "math/dense/dense.hpp"

namespace flyball::identification {
namespace {

constexpr std::size_t enough_rows = 500;  // residuals of a run, for the sizes of the noise
constexpr int most_sweeps = 6;
constexpr double shortest_disturbance = 0.3;  // s, of memory
constexpr double longest_disturbance = 3.0;   // s
constexpr double shortest_average = 1e-3;     // s, of a velocity
constexpr double leap = 10.0;                 // standard deviations
constexpr double settled = 0.1;               // of −2 ln likelihood, that a sweep gains

/// The mechanism that the noise disturbs.
struct Plant {
  explicit Plant(const Eigen::VectorXd& x)
      : kV(x[parameter::velocity_gain]),
        tau(std::exp(x[parameter::log_time_constant])),
        kA(kV * tau) {}
  double kV;
  double tau;
  double kA;
};

/// A residual of the free run: measured − simulated.
struct Miss {
  double time;  ///< s, of the mechanism.
  bool of_position;
  double value;  ///< unit or unit/s.
};

struct MissedRun {
  double begin = 0.0;
  bool at_rest = false;
  std::vector<Miss> misses;
};

MissedRun misses_of(OutputErrorProblem& problem, std::size_t index, const Eigen::VectorXd& x) {
  const ResidualRun& run = problem.runs()[index];
  const TestRun& source = problem.recording().runs[run.prepared].run;
  ResidualBlock block;
  problem.evaluate(index, x, block);
  MissedRun missed{run.input.time.front(), run.starts_at_rest, {}};
  const double position_delay = x[parameter::position_delay] + x[extra_delay_of(index)];
  const double velocity_delay = x[parameter::velocity_delay] + x[extra_delay_of(index)];
  const auto add = [&](double time, bool of_position, double value) {
    if (time >= missed.begin) {
      missed.misses.push_back({time, of_position, value});
    }
  };
  std::vector<std::size_t> rows;
  for (const auto& [from, to] : run.differences) {
    rows.push_back(from);
    rows.push_back(to);
  }
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  for (const std::size_t row : rows) {
    add(source.time[row] - position_delay, true,
        source.position[row] - problem.position_shown(index, x, source.time[row]));
  }
  for (std::size_t k = 0; k < run.velocities.size(); ++k) {
    add(source.time[run.velocities[k]] - velocity_delay, false,
        block.velocity[static_cast<Eigen::Index>(k)]);
  }
  std::stable_sort(missed.misses.begin(), missed.misses.end(),
                   [](const Miss& a, const Miss& b) { return a.time < b.time; });
  // Of a long run the middle tells the sizes well enough.
  if (missed.misses.size() > enough_rows) {
    const auto before = static_cast<std::ptrdiff_t>((missed.misses.size() - enough_rows) / 2);
    missed.misses.erase(missed.misses.begin(), missed.misses.begin() + before);
    missed.misses.resize(enough_rows, missed.misses.front());
    missed.begin = missed.misses.front().time;
    missed.at_rest = false;
  }
  return missed;
}

/// −2 ln of a residual's likelihood by its square over its variance: beyond three standard
/// deviations it grows linearly.
double misfit(double square_over_variance) {
  constexpr double limit = 3.0;
  return square_over_variance <= limit * limit
             ? square_over_variance
             : limit * (2.0 * std::sqrt(square_over_variance) - limit);
}

/// How a state goes on in a step of time: position and velocity error, disturbance.
struct Step {
  Step(double length, const Plant& plant, const RecordNoise& noise)
      : duration(length),
        a(std::exp(-length / plant.tau)),
        c(plant.tau * (1.0 - a)),
        by_force((1.0 - a) / plant.kV),
        way_by_force((length - c) / plant.kV),
        rho(std::exp(-length / noise.memory)) {
    // ∫ of the responses' products, [τ(1 − e^(−t/τ)), e^(−t/τ)]/kA to a volt's impulse.
    const double intensity = square(noise.voltage / plant.kA);
    const double half = 0.5 * plant.tau * (1.0 - a * a);
    Q00 = intensity * square(plant.tau) * std::max(0.0, length - 2.0 * c + half);
    Q01 = intensity * 0.5 * square(c);
    Q11 = intensity * half;
    Q22 = square(noise.disturbance) * (1.0 - rho * rho);
  }
  double duration, a, c, by_force, way_by_force, rho;
  double Q00, Q01, Q11, Q22;
};

/// Estimate and covariance of position and velocity error and the disturbance.
struct Belief {
  double p = 0.0, v = 0.0, d = 0.0;
  double P00 = 0.0, P01 = 0.0, P02 = 0.0, P11 = 0.0, P12 = 0.0, P22 = 0.0;

  void predict(const Step& s) {
    p += s.c * v + s.way_by_force * d;
    v = s.a * v + s.by_force * d;
    d *= s.rho;
    // F P Fᵀ with F = [1 c w; 0 a b; 0 0 ρ].
    const double p0 = P01 + s.c * P11 + s.way_by_force * P12;  // of (F P)₀ on the velocity
    const double p2 = P02 + s.c * P12 + s.way_by_force * P22;
    const double v1 = s.a * P11 + s.by_force * P12;
    const double v2 = s.a * P12 + s.by_force * P22;
    P00 += s.c * P01 + s.way_by_force * P02 + s.c * p0 + s.way_by_force * p2 + s.Q00;
    P01 = s.a * p0 + s.by_force * p2 + s.Q01;
    P02 = s.rho * p2;
    P11 = s.a * v1 + s.by_force * v2 + s.Q11;
    P12 = s.rho * v2;
    P22 = s.rho * s.rho * P22 + s.Q22;
  }
  /// Where the position is, is not compared: where a run starts, and beyond a leap.
  void place(const Miss& miss, const RecordNoise& noise) {
    p = miss.value;
    P01 = P02 = 0.0;
    P00 = square(noise.position);
  }
  /// Whether no noise moves a position so far: a coupling that slipped, counts that were lost. It
  /// is there for good, and what is left of it would be taken for noise of all values.
  [[nodiscard]] bool leaps(const Miss& miss, const RecordNoise& noise) const {
    return miss.of_position &&
           square(miss.value - p) > square(leap) * (P00 + square(noise.position));
  }
  /// @return  −2 ln likelihood of the value.
  double correct(const Miss& miss, const RecordNoise& noise) {
    const double k0 = miss.of_position ? P00 : P01;
    const double k1 = miss.of_position ? P01 : P11;
    const double k2 = miss.of_position ? P02 : P12;
    const double variance =
        miss.of_position ? P00 + square(noise.position) : P11 + square(noise.velocity);
    const double innovation = miss.value - (miss.of_position ? p : v);
    // An outlier moves the state no further than three standard deviations.
    const double limit = 3.0 * std::sqrt(variance);
    const double moved = std::clamp(innovation, -limit, limit) / variance;
    p += k0 * moved;
    v += k1 * moved;
    d += k2 * moved;
    const double inverse_variance = 1.0 / variance;
    P00 -= k0 * k0 * inverse_variance;
    P01 -= k0 * k1 * inverse_variance;
    P02 -= k0 * k2 * inverse_variance;
    P11 -= k1 * k1 * inverse_variance;
    P12 -= k1 * k2 * inverse_variance;
    P22 -= k2 * k2 * inverse_variance;
    return std::log(variance) + misfit(square(innovation) * inverse_variance);
  }
};

/// −2 ln likelihood of a run.
double unlikelihood(const MissedRun& run, const Plant& plant, const RecordNoise& noise,
                    double top_speed) {
  Belief belief;
  belief.P11 = run.at_rest ? 0.0 : square(0.1 * top_speed);
  belief.P22 = square(noise.disturbance);
  Step step(0.0, plant, noise);
  double sum = 0.0;
  double time = run.begin;
  bool placed = false;
  for (const Miss& miss : run.misses) {
    if (const double length = miss.time - time; length > 0.0) {
      if (std::abs(length - step.duration) > 1e-9) {
        step = Step(length, plant, noise);
      }
      belief.predict(step);
      time = miss.time;
    }
    if (miss.of_position && !placed) {
      placed = true;
      belief.place(miss, noise);
    } else if (belief.leaps(miss, noise)) {
      sum += std::log(belief.P00 + square(noise.position)) + misfit(square(leap));
      belief.place(miss, noise);
    } else {
      sum += belief.correct(miss, noise);
    }
  }
  return sum;
}

}  // namespace

RecordNoise estimate_record_noise(OutputErrorProblem& problem, const Eigen::VectorXd& x,
                                  const ChannelScales& scales) {
  const Plant plant(x);
  std::vector<MissedRun> runs;
  for (std::size_t i = 0; i < problem.runs().size(); ++i) {
    runs.push_back(misses_of(problem, i, x));
  }
  const auto cost = [&](const RecordNoise& of) {
    double sum = 0.0;
    for (const MissedRun& run : runs) {
      sum += unlikelihood(run, plant, of, problem.recording().top_speed);
    }
    return sum;
  };
  RecordNoise noise;
  noise.position = 0.5 * scales.difference;
  noise.velocity = scales.velocity;
  // What lasts comes last, to be told what white noise does not explain.
  std::vector<double RecordNoise::*> sizes{&RecordNoise::voltage};
  if (scales.difference > 0.0) {
    sizes.push_back(&RecordNoise::position);
  }
  if (scales.velocity > 0.0) {
    sizes.push_back(&RecordNoise::velocity);
  }
  sizes.push_back(&RecordNoise::disturbance);
  sizes.push_back(&RecordNoise::memory);
  // One size after the other to the vertex of a parabola through three, in their logarithms.
  double least = cost(noise);
  std::array<double, 5> steps;
  steps.fill(0.7);
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    const double before = least;
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      const double step = steps[k];
      const double middle = least;
      const RecordNoise from = noise;
      const auto try_step = [&](double in_logarithm) {
        RecordNoise tried = from;
        tried.*sizes[k] *= std::exp(in_logarithm);
        tried.memory = std::clamp(tried.memory, shortest_disturbance, longest_disturbance);
        const double found = cost(tried);
        if (found < least) {
          least = found;
          noise = tried;
        }
        return found;
      };
      const double up = try_step(step);
      const double down = try_step(-step);
      const double curvature = up + down - 2.0 * middle;
      const double farthest = 3.0 * step;
      const double vertex =
          curvature > 0.0 ? std::clamp(0.5 * step * (down - up) / curvature, -farthest, farthest)
                          : std::copysign(farthest, down - up);
      try_step(vertex);
      steps[k] = std::clamp(std::abs(vertex), 0.1, 1.5);
    }
    if (before - least < settled) {
      break;
    }
  }
  return noise;
}

namespace {

/// What a unit of each residual adds to the scores, ψ' J/σ², in a column: first those of position
/// differences, then those of velocities.
Eigen::MatrixXd score_columns(const ResidualBlock& block, const ChannelScales& scales) {
  const Eigen::Index differences = block.difference.size();
  Eigen::MatrixXd columns(static_cast<Eigen::Index>(block.columns.size()),
                          differences + block.velocity.size());
  const auto fill = [](auto&& to, const Eigen::VectorXd& residuals,
                       const ResidualBlock::Jacobian& jacobian, double inverse_scale) {
    for (Eigen::Index k = 0; k < residuals.size(); ++k) {
      const double w = weight(residuals[k] * inverse_scale);
      to.col(k) = (w * w * w * square(inverse_scale)) * jacobian.row(k).transpose();
    }
  };
  fill(columns.leftCols(differences), block.difference, block.difference_jacobian,
       inverse(scales.difference));
  fill(columns.rightCols(block.velocity.size()), block.velocity, block.velocity_jacobian,
       inverse(scales.velocity));
  return columns;
}

/// A position's noise is in each difference that the value ends or begins.
void add_position_noise(Eigen::MatrixXd& sum, const Eigen::MatrixXd& columns,
                        const ResidualRun& run, const std::vector<double>& time, double deviation,
                        double quantum) {
  struct End {
    std::size_t row;
    Eigen::Index difference;
    double sign;
  };
  std::vector<End> ends;
  for (std::size_t k = 0; k < run.differences.size(); ++k) {
    ends.push_back({run.differences[k].first, static_cast<Eigen::Index>(k), -1.0});
    ends.push_back({run.differences[k].second, static_cast<Eigen::Index>(k), 1.0});
  }
  std::stable_sort(ends.begin(), ends.end(),
                   [](const End& a, const End& b) { return a.row < b.row; });
  for (std::size_t k = 0; k < ends.size();) {
    const std::size_t row = ends[k].row;
    Eigen::VectorXd by_value = Eigen::VectorXd::Zero(columns.rows());
    for (; k < ends.size() && ends[k].row == row; ++k) {
      by_value += ends[k].sign * columns.col(ends[k].difference);
    }
    // What rests where it was zeroed stands at an edge of the encoder's step, not in its middle.
    const bool rests = run.starts_at_rest && time[row] <= run.input.time.front();
    const double of_value = rests ? std::max(deviation, 0.5 * quantum) : deviation;
    by_value *= of_value;
    sum.noalias() += by_value * by_value.transpose();
  }
}

/// A position of the mechanism that a residual looks at, and by how much.
struct Look {
  double time;
  Eigen::Index residual;
  double factor;
};

/// What all residuals of a run look at, the latest first: the ends of position differences and of
/// the velocity's averages.
std::vector<Look> looks_of(const ResidualRun& run, const std::vector<double>& time,
                           const Eigen::VectorXd& x, std::size_t index) {
  std::vector<Look> looks;
  const double position_delay = x[parameter::position_delay] + x[extra_delay_of(index)];
  Eigen::Index residual = 0;
  for (const auto& [from, to] : run.differences) {
    looks.push_back({time[to] - position_delay, residual, 1.0});
    looks.push_back({time[from] - position_delay, residual, -1.0});
    ++residual;
  }
  const double velocity_delay = x[parameter::velocity_delay] + x[extra_delay_of(index)];
  const double half = 0.5 * std::max(x[parameter::averaging_width], shortest_average);
  const double factor = 0.5 * x[parameter::velocity_scale] / half;
  for (const std::size_t row : run.velocities) {
    const double middle = time[row] - velocity_delay;
    looks.push_back({middle + half, residual, factor});
    looks.push_back({middle - half, residual, -factor});
    ++residual;
  }
  std::sort(looks.begin(), looks.end(),
            [](const Look& a, const Look& b) { return a.time > b.time; });
  return looks;
}

/// What a volt more between two rows adds to the scores, in a column for each row but the last:
/// backwards in time through the mechanism, whose position and velocity have an adjoint each.
Eigen::MatrixXd by_voltage(const std::vector<Look>& looks, const std::vector<double>& rows,
                           const Eigen::MatrixXd& columns, const Plant& plant) {
  const auto pieces = static_cast<Eigen::Index>(rows.size()) - 1;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(columns.rows(), std::max<Eigen::Index>(pieces, 0));
  Eigen::VectorXd by_position = Eigen::VectorXd::Zero(columns.rows());
  Eigen::VectorXd by_speed = Eigen::VectorXd::Zero(columns.rows());
  std::size_t next = 0;
  double time = rows.back();
  const auto look = [&] {
    for (; next < looks.size() && looks[next].time >= time; ++next) {
      const auto& [at, residual, factor] = looks[next];
      by_position += factor * columns.col(residual);
      // Beyond the last row the speed stays.
      by_speed += factor * std::max(0.0, at - rows.back()) * columns.col(residual);
    }
  };
  look();
  for (Eigen::Index piece = pieces - 1; piece >= 0; --piece) {
    const double begin = rows[static_cast<std::size_t>(piece)];
    while (time > begin) {
      const double until = next < looks.size() ? std::max(begin, looks[next].time) : begin;
      const double a = std::exp((until - time) / plant.tau);
      const double c = plant.tau * (1.0 - a);
      sum.col(piece) +=
          (1.0 - a) / plant.kV * by_speed + (time - until - c) / plant.kV * by_position;
      by_speed *= a;
      by_speed += c * by_position;
      time = until;
      look();
    }
  }
  return sum;
}

}  // namespace

Eigen::MatrixXd score_covariance(OutputErrorProblem& problem, const Eigen::VectorXd& x,
                                 const std::vector<bool>& free, const ChannelScales& scales,
                                 const RecordNoise& noise) {
  const Plant plant(x);
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(x.size(), x.size());
  ResidualBlock block;
  for (std::size_t index = 0; index < problem.runs().size(); ++index) {
    const ResidualRun& run = problem.runs()[index];
    const std::vector<double>& time = problem.recording().runs[run.prepared].run.time;
    problem.evaluate(index, x, free, block);
    const Eigen::MatrixXd columns = score_columns(block, scales);
    const Eigen::MatrixXd by_velocity = noise.velocity * columns.rightCols(block.velocity.size());
    Eigen::MatrixXd sum = detail::product_transposed(by_velocity, by_velocity);
    add_position_noise(sum, columns, run, time, noise.position,
                       problem.recording().position_quantum);
    Eigen::MatrixXd volts =
        by_voltage(looks_of(run, time, x, index), run.input.time, columns, plant);
    for (Eigen::Index k = 0; k < volts.cols(); ++k) {
      const auto row = static_cast<std::size_t>(k);
      const double held = run.input.time[row + 1] - run.input.time[row];
      volts.col(k) *= noise.voltage / std::sqrt(std::max(held, 1e-6));
    }
    sum += detail::product_transposed(volts, volts);
    scatter(all, sum, block.columns);
  }
  return all;
}

}  // namespace flyball::identification
