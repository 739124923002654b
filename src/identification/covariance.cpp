#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "identification/robust_fit.hpp"
#include "identification/soft_loss.hpp"

namespace flyball::identification {
namespace {

constexpr double bin_width = 0.02;    // s
constexpr int lags = 30;              // bins: correlation is followed for 0.6 s
constexpr double block_length = 0.6;  // s

/// A run's residuals and Jacobians summed over bins of time, per channel.
struct Bins {
  struct ChannelBin {
    double residual = 0.0;  // sum of ψ
    int count = 0;
    LocalVector jacobian = LocalVector::Zero();
    LocalVector score = LocalVector::Zero();
  };
  std::array<std::vector<ChannelBin>, 2> channels;
  bool ramp = false;
};

/// Adds one channel of a run to its bins; returns what it adds to Σ Jᵀ ψ'(z) J.
LocalMatrix bin_channel(const Eigen::VectorXd& residuals, const ResidualBlock::Jacobian& jacobian,
                        double inverse_scale, const std::vector<double>& times,
                        std::vector<Bins::ChannelBin>& bins) {
  LocalMatrix hessian = LocalMatrix::Zero();
  for (Eigen::Index row = 0; row < residuals.size(); ++row) {
    const double z = residuals[row] * inverse_scale;
    const double w = weight(z);
    const LocalVector j = jacobian.row(row).transpose() * inverse_scale;
    const auto at = static_cast<std::size_t>(times[static_cast<std::size_t>(row)] / bin_width);
    if (at >= bins.size()) {
      bins.resize(at + 1);
    }
    bins[at].residual += w * z;
    bins[at].count += 1;
    bins[at].jacobian += j;
    bins[at].score += w * z * j;
    add_square(hessian, w * w * w, j);  // ψ' = w³
  }
  return hessian;
}

std::vector<double> residual_times(const OutputErrorProblem& problem, std::size_t index,
                                   Channel channel) {
  const ResidualRun& run = problem.runs()[index];
  const std::vector<double>& time = problem.recording().runs[run.prepared].run.time;
  // From the bin of the first row that is used: what stands before may be years away.
  const std::size_t used = problem.recording().runs[run.prepared].first;
  const double origin =
      time.front() + bin_width * std::floor((time[used] - time.front()) / bin_width);
  std::vector<double> times;
  if (channel == Channel::position) {
    for (const auto& [from, to] : run.differences) {
      times.push_back(std::max(0.0, 0.5 * (time[from] + time[to]) - origin));
    }
  } else {
    for (const std::size_t row : run.velocities) {
      times.push_back(std::max(0.0, time[row] - origin));
    }
  }
  return times;
}

double bartlett(int lag) {
  return 1.0 - static_cast<double>(lag) / (lags + 1);
}

/// Means of a bin's residuals; NaN-free: bins without rows have weight 0.
double mean_residual(const Bins::ChannelBin& bin) {
  return bin.count > 0 ? bin.residual / bin.count : 0.0;
}

/// Autocovariance and cross-covariance of the binned residuals of ramps or of steps.
using Covariogram = std::array<std::array<std::array<double, lags + 1>, 2>, 2>;
Covariogram covariogram(const std::vector<Bins>& runs, bool ramps) {
  Covariogram sum{};
  Covariogram count{};
  for (const Bins& run : runs) {
    if (run.ramp != ramps) {
      continue;
    }
    for (std::size_t a = 0; a < 2; ++a) {
      for (std::size_t b = 0; b < 2; ++b) {
        for (std::size_t i = 0; i < run.channels[a].size(); ++i) {
          for (std::size_t lag = 0; lag <= lags && i + lag < run.channels[b].size(); ++lag) {
            const Bins::ChannelBin& first = run.channels[a][i];
            const Bins::ChannelBin& second = run.channels[b][i + lag];
            if (first.count > 0 && second.count > 0) {
              sum[a][b][lag] += mean_residual(first) * mean_residual(second);
              count[a][b][lag] += 1.0;
            }
          }
        }
      }
    }
  }
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t b = 0; b < 2; ++b) {
      for (std::size_t lag = 0; lag <= lags; ++lag) {
        sum[a][b][lag] = count[a][b][lag] > 0.0 ? sum[a][b][lag] / count[a][b][lag] : 0.0;
      }
    }
  }
  return sum;
}
LocalVector score_at(const Bins& run, std::size_t bin) {
  LocalVector score = LocalVector::Zero();
  for (const auto& channel : run.channels) {
    if (bin < channel.size()) {
      score += channel[bin].score;
    }
  }
  return score;
}

std::size_t bin_count(const Bins& run) {
  return std::max(run.channels[0].size(), run.channels[1].size());
}

/// Newey–West: the scores' own covariances up to 0.6 s under a Bartlett window.
LocalMatrix hac_middle(const Bins& run) {
  LocalMatrix middle = LocalMatrix::Zero();
  const std::size_t bins = bin_count(run);
  std::vector<LocalVector> scores(bins);
  for (std::size_t i = 0; i < bins; ++i) {
    scores[i] = score_at(run, i);
  }
  for (std::size_t i = 0; i < bins; ++i) {
    LocalVector later = 0.5 * scores[i];
    for (std::size_t lag = 1; lag <= lags && i + lag < bins; ++lag) {
      later += bartlett(static_cast<int>(lag)) * scores[i + lag];
    }
    const LocalMatrix cross = scores[i] * later.transpose();
    middle += cross + cross.transpose();
  }
  return middle;
}

/// Sums of scores over blocks of 0.6 s count as independent.
LocalMatrix block_middle(const Bins& run, std::size_t& blocks) {
  LocalMatrix middle = LocalMatrix::Zero();
  const auto length = static_cast<std::size_t>(block_length / bin_width);
  const std::size_t bins = bin_count(run);
  for (std::size_t begin = 0; begin < bins; begin += length) {
    LocalVector sum = LocalVector::Zero();
    for (std::size_t i = begin; i < std::min(bins, begin + length); ++i) {
      sum += score_at(run, i);
    }
    if (sum.squaredNorm() > 0.0) {
      middle += sum * sum.transpose();
      ++blocks;
    }
  }
  return middle;
}

/// Jᵀ Γ J with the residuals' autocovariance Γ, tapered so that it stays positive.
LocalMatrix correlation_middle(const Bins& run, const Covariogram& gamma) {
  LocalMatrix middle = LocalMatrix::Zero();
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t b = 0; b < 2; ++b) {
      const auto& first = run.channels[a];
      const auto& second = run.channels[b];
      for (std::size_t i = 0; i < first.size(); ++i) {
        if (first[i].count == 0) {
          continue;
        }
        LocalVector sum = LocalVector::Zero();
        for (std::size_t lag = 0; lag <= lags && i + lag < second.size(); ++lag) {
          sum += (bartlett(static_cast<int>(lag)) * gamma[a][b][lag]) * second[i + lag].jacobian;
        }
        const LocalMatrix cross = first[i].jacobian * sum.transpose();
        middle += cross + cross.transpose();
        // Lag 0 must count once; both orders of a pair of channels are in the sum over a and b.
        if (i < second.size()) {
          const LocalMatrix same =
              gamma[a][b][0] * first[i].jacobian * second[i].jacobian.transpose();
          middle -= 0.5 * (same + same.transpose());
        }
      }
    }
  }
  return middle;
}

/// Whether a parameter lies on one of its bounds.
bool at_bound(const Eigen::VectorXd& x, const Bounds& bounds, Eigen::Index i) {
  const double slack = 1e-9 * (1.0 + std::abs(x[i]));
  return x[i] <= bounds.lower[i] + slack || x[i] >= bounds.upper[i] - slack;
}

}  // namespace

double Covariances::inflation(Eigen::Index parameter) const {
  const double alone = independent(parameter, parameter);
  double largest = alone;
  for (const Eigen::MatrixXd& estimate : estimates) {
    largest = std::max(largest, estimate(parameter, parameter));
  }
  return alone > 0.0 ? largest / alone : 1.0;
}

double Covariances::standard_error(const Eigen::VectorXd& gradient) const {
  double largest = 0.0;
  for (const Eigen::MatrixXd& covariance : estimates) {
    largest = std::max(largest, gradient.dot(covariance * gradient));
  }
  double of_model = 0.0;
  for (const Eigen::VectorXd& doubt : doubts) {
    of_model = std::max(of_model, std::abs(gradient.dot(doubt)));
  }
  return std::sqrt(largest + of_model * of_model);
}

Covariances covariances(OutputErrorProblem& problem, const Eigen::VectorXd& x,
                        const std::vector<bool>& free, const Bounds& bounds,
                        const ChannelScales& scales) {
  const Eigen::Index n = x.size();
  Eigen::MatrixXd bread = Eigen::MatrixXd::Zero(n, n);
  std::vector<Bins> runs(problem.runs().size());
  ResidualBlock block;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    problem.evaluate(i, x, true, block);
    runs[i].ramp = problem.runs()[i].ramp;
    LocalMatrix hessian =
        bin_channel(block.difference, block.difference_jacobian, inverse(scales.difference),
                    residual_times(problem, i, Channel::position), runs[i].channels[0]);
    hessian += bin_channel(block.velocity, block.velocity_jacobian, inverse(scales.velocity),
                           residual_times(problem, i, Channel::velocity), runs[i].channels[1]);
    scatter(bread, hessian, i);
  }

  // The same holds, more weakly, for what only nuisance parameters and kA may lack: data.
  bread(parameter::log_time_constant, parameter::log_time_constant) += 0.1;
  for (const OutputErrorProblem::Prior& prior : problem.priors()) {
    bread(prior.parameter, prior.parameter) += 1.0 / square(prior.deviation);
  }

  const Covariogram ramp_gamma = covariogram(runs, true);
  const Covariogram step_gamma = covariogram(runs, false);
  std::array<Eigen::MatrixXd, 3> middles;
  middles.fill(Eigen::MatrixXd::Zero(n, n));
  std::size_t blocks = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    scatter(middles[0], hac_middle(runs[i]), i);
    scatter(middles[1], block_middle(runs[i], blocks), i);
    scatter(middles[2], correlation_middle(runs[i], runs[i].ramp ? ramp_gamma : step_gamma), i);
  }

  std::vector<Eigen::Index> active;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (free[static_cast<std::size_t>(i)] && !at_bound(x, bounds, i) && bread(i, i) > 0.0) {
      active.push_back(i);
    }
  }
  Covariances result;
  result.estimates.fill(Eigen::MatrixXd::Zero(n, n));
  result.independent = Eigen::MatrixXd::Zero(n, n);
  const auto size = static_cast<Eigen::Index>(active.size());
  // Equilibrated, so that the pivots tell how well the parameters are told apart.
  const Eigen::VectorXd equilibrium = bread.diagonal()(active).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled =
      equilibrium.asDiagonal() * bread(active, active) * equilibrium.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> factor(scaled);
  if (size == 0 || factor.vectorD().minCoeff() < 1e-13) {
    result.singular = true;
    return result;
  }
  const Eigen::MatrixXd inverse_bread = equilibrium.asDiagonal() *
                                        factor.solve(Eigen::MatrixXd::Identity(size, size)) *
                                        equilibrium.asDiagonal();
  result.independent(active, active) = inverse_bread;
  const double blocks_left = std::max(1.0, static_cast<double>(blocks) - static_cast<double>(size));
  for (std::size_t k = 0; k < middles.size(); ++k) {
    const Eigen::MatrixXd covariance = inverse_bread * middles[k](active, active) * inverse_bread *
                                       (k == 1 ? static_cast<double>(blocks) / blocks_left : 1.0);
    result.estimates[k](active, active) = covariance;
  }
  return result;
}

}  // namespace flyball::identification