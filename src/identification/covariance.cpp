#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "identification/record_noise.hpp"
#include "identification/robust_fit.hpp"
#include "identification/soft_loss.hpp"
#include "math/dense/dense.hpp"

namespace flyball::identification {
namespace {

constexpr int lags = 30;                 // bins, for which correlation is followed
constexpr double shortest_memory = 0.6;  // s, that they are at least
constexpr double longest_memory = 3.0;   // s
constexpr double time_constants = 6.0;   // that they are: noise of the voltage decays so slowly

/// s, of a bin.
double bin_width_of(const Eigen::VectorXd& x) {
  const double memory = time_constants * std::exp(x[parameter::log_time_constant]);
  return std::clamp(memory, shortest_memory, longest_memory) / lags;
}

/// A run's residuals and Jacobians summed over bins of time, a bin a column.
struct ChannelBins {
  Eigen::VectorXd residual;  // sum of ψ
  Eigen::VectorXd count;
  Eigen::MatrixXd jacobian;
  Eigen::MatrixXd score;
};
struct Bins {
  std::array<ChannelBins, 2> channels;
  std::vector<Eigen::Index> columns;  ///< The parameters of the Jacobians' rows.
  bool ramp = false;
};

/// The bins of one channel of a run; adds to Σ Jᵀ ψ'(z) J.
ChannelBins bin_channel(const Eigen::VectorXd& residuals, const ResidualBlock::Jacobian& jacobian,
                        double inverse_scale, const std::vector<double>& times, double bin_width,
                        Eigen::MatrixXd& hessian) {
  const double last = times.empty() ? -bin_width : *std::max_element(times.begin(), times.end());
  const auto bins = static_cast<Eigen::Index>(last / bin_width) + 1;
  const Eigen::Index columns = jacobian.cols();
  ChannelBins channel{Eigen::VectorXd::Zero(bins), Eigen::VectorXd::Zero(bins),
                      Eigen::MatrixXd::Zero(columns, bins), Eigen::MatrixXd::Zero(columns, bins)};
  Eigen::VectorXd weights(residuals.size());
  for (Eigen::Index row = 0; row < residuals.size(); ++row) {
    const double z = residuals[row] * inverse_scale;
    const double w = weight(z);
    const auto at = static_cast<Eigen::Index>(times[static_cast<std::size_t>(row)] / bin_width);
    channel.residual[at] += w * z;
    channel.count[at] += 1.0;
    channel.jacobian.col(at) += inverse_scale * jacobian.row(row).transpose();
    channel.score.col(at) += (w * z * inverse_scale) * jacobian.row(row).transpose();
    weights[row] = w * w * w * square(inverse_scale);  // ψ' = w³
  }
  add_squares(hessian, jacobian, weights);
  return channel;
}

std::vector<double> residual_times(const OutputErrorProblem& problem, std::size_t index,
                                   Channel channel, double bin_width) {
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
        const ChannelBins& first = run.channels[a];
        const ChannelBins& second = run.channels[b];
        for (Eigen::Index i = 0; i < first.count.size(); ++i) {
          for (Eigen::Index lag = 0; lag <= lags && i + lag < second.count.size(); ++lag) {
            if (first.count[i] > 0.0 && second.count[i + lag] > 0.0) {
              const auto at = static_cast<std::size_t>(lag);
              sum[a][b][at] += first.residual[i] / first.count[i] * second.residual[i + lag] /
                               second.count[i + lag];
              count[a][b][at] += 1.0;
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

/// A run's scores of both channels.
Eigen::MatrixXd scores_of(const Bins& run) {
  const auto& [first, second] = run.channels;
  Eigen::MatrixXd scores =
      Eigen::MatrixXd::Zero(first.score.rows(), std::max(first.score.cols(), second.score.cols()));
  scores.leftCols(first.score.cols()) += first.score;
  scores.leftCols(second.score.cols()) += second.score;
  return scores;
}

/// To each of `count` columns the sum of it and of those of M that come after, with a weight for
/// each lag.
Eigen::MatrixXd sum_later(const Eigen::MatrixXd& M, Eigen::Index count,
                          const std::array<double, lags + 1>& weights) {
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(M.rows(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index lag = 0; lag <= lags && i + lag < M.cols(); ++lag) {
      sums.col(i) += weights[static_cast<std::size_t>(lag)] * M.col(i + lag);
    }
  }
  return sums;
}

/// A Bᵀ + B Aᵀ.
Eigen::MatrixXd both_orders(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  const Eigen::MatrixXd product = detail::product_transposed(A, B);
  return product + product.transpose();
}

/// Newey–West: the scores' own covariances under a Bartlett window.
Eigen::MatrixXd hac_middle(const Eigen::MatrixXd& scores) {
  std::array<double, lags + 1> weights{0.5};
  for (int lag = 1; lag <= lags; ++lag) {
    weights[static_cast<std::size_t>(lag)] = bartlett(lag);
  }
  return both_orders(scores, sum_later(scores, scores.cols(), weights));
}

/// Sums of scores over blocks as long as the memory count as independent.
Eigen::MatrixXd block_middle(const Eigen::MatrixXd& scores, std::size_t& blocks) {
  constexpr Eigen::Index length = lags;
  Eigen::MatrixXd sums(scores.rows(), (scores.cols() + length - 1) / length);
  for (Eigen::Index k = 0; k < sums.cols(); ++k) {
    const Eigen::Index begin = k * length;
    sums.col(k) = scores.middleCols(begin, std::min(length, scores.cols() - begin)).rowwise().sum();
    blocks += sums.col(k).squaredNorm() > 0.0 ? 1U : 0U;
  }
  return detail::product_transposed(sums, sums);
}

/// Jᵀ Γ J with the residuals' autocovariance Γ, tapered so that it stays positive.
Eigen::MatrixXd correlation_middle(const Bins& run, const Covariogram& gamma) {
  const Eigen::Index columns = run.channels[0].jacobian.rows();
  Eigen::MatrixXd middle = Eigen::MatrixXd::Zero(columns, columns);
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t b = 0; b < 2; ++b) {
      const Eigen::MatrixXd& first = run.channels[a].jacobian;
      const Eigen::MatrixXd& second = run.channels[b].jacobian;
      // Lag 0 must count once; both orders of a pair of channels are in the sum over a and b.
      std::array<double, lags + 1> weights{0.5 * gamma[a][b][0]};
      for (int lag = 1; lag <= lags; ++lag) {
        weights[static_cast<std::size_t>(lag)] =
            bartlett(lag) * gamma[a][b][static_cast<std::size_t>(lag)];
      }
      middle += both_orders(first, sum_later(second, first.cols(), weights));
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

double Covariances::score_inflation(Eigen::Index parameter) const {
  const double alone = independent(parameter, parameter);
  const double largest = std::max({alone, estimates[0](parameter, parameter),
                                   estimates[1](parameter, parameter) / few_blocks,
                                   estimates[2](parameter, parameter)});
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

namespace {

/// A + (B - A)₊, no smaller than A or B; in units of their diagonals.
Eigen::MatrixXd above_both(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  const Eigen::VectorXd units =
      A.diagonal().cwiseMax(B.diagonal()).cwiseMax(0.0).cwiseSqrt().unaryExpr([](double s) {
        return s > 0.0 ? s : 1.0;
      });
  const Eigen::VectorXd inverse = units.cwiseInverse();
  const Eigen::MatrixXd difference = inverse.asDiagonal() * (B - A) * inverse.asDiagonal();
  const auto eigen = detail::symmetric_eigensystem_of(detail::symmetrized(difference));
  const Eigen::MatrixXd V = units.asDiagonal() * eigen.vectors;
  const Eigen::VectorXd positive = eigen.values.cwiseMax(0.0);
  return A + V * positive.asDiagonal() * V.transpose();
}

}  // namespace

Eigen::MatrixXd Covariances::joint(const Eigen::MatrixXd& gradients) const {
  const Eigen::Index count = gradients.rows();
  Eigen::MatrixXd bound = Eigen::MatrixXd::Zero(count, count);
  for (const Eigen::MatrixXd& covariance : estimates) {
    bound = above_both(bound, gradients * covariance * gradients.transpose());
  }
  Eigen::MatrixXd of_model = Eigen::MatrixXd::Zero(count, count);
  for (const Eigen::VectorXd& doubt : doubts) {
    const Eigen::VectorXd step = gradients * doubt;
    of_model = above_both(of_model, step * step.transpose());
  }
  return detail::symmetrized(bound + of_model);
}

Covariances covariances(OutputErrorProblem& problem, const Eigen::VectorXd& x,
                        const std::vector<bool>& free, const Bounds& bounds,
                        const ChannelScales& scales, const RecordNoise* noise) {
  const Eigen::Index n = x.size();
  Eigen::MatrixXd bread = Eigen::MatrixXd::Zero(n, n);
  std::vector<Bins> runs(problem.runs().size());
  const double bin_width = bin_width_of(x);
  ResidualBlock block;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    problem.evaluate(i, x, free, block);
    const auto columns = static_cast<Eigen::Index>(block.columns.size());
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(columns, columns);
    runs[i].ramp = problem.runs()[i].ramp;
    runs[i].columns = block.columns;
    runs[i].channels = {
        bin_channel(block.difference, block.difference_jacobian, inverse(scales.difference),
                    residual_times(problem, i, Channel::position, bin_width), bin_width, hessian),
        bin_channel(block.velocity, block.velocity_jacobian, inverse(scales.velocity),
                    residual_times(problem, i, Channel::velocity, bin_width), bin_width, hessian)};
    scatter(bread, hessian, block.columns);
  }

  // The same holds, more weakly, for what only nuisance parameters and kA may lack: data.
  bread(parameter::log_time_constant, parameter::log_time_constant) += 0.1;
  for (const OutputErrorProblem::Prior& prior : problem.priors()) {
    bread(prior.parameter, prior.parameter) += 1.0 / square(prior.deviation);
  }
  for (const Eigen::Index a : problem.ages()) {
    for (const Eigen::Index b : problem.ages()) {
      bread(a, b) += age_weight(problem);
    }
  }

  const Covariogram ramp_gamma = covariogram(runs, true);
  const Covariogram step_gamma = covariogram(runs, false);
  std::array<Eigen::MatrixXd, 3> middles;
  middles.fill(Eigen::MatrixXd::Zero(n, n));
  std::size_t blocks = 0;
  for (const Bins& run : runs) {
    const Eigen::MatrixXd scores = scores_of(run);
    scatter(middles[0], hac_middle(scores), run.columns);
    scatter(middles[1], block_middle(scores, blocks), run.columns);
    scatter(middles[2], correlation_middle(run, run.ramp ? ramp_gamma : step_gamma), run.columns);
  }
  if (noise != nullptr) {
    middles[1] = score_covariance(problem, x, free, scales, *noise);
  }
  // What is known before the data has an error, too.
  for (const OutputErrorProblem::Prior& prior : problem.priors()) {
    for (Eigen::MatrixXd& middle : middles) {
      middle(prior.parameter, prior.parameter) += 1.0 / square(prior.deviation);
    }
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
  // Where in a row a ramp's sensor was read is not fitted, as a ramp cannot tell it from friction:
  // its share differs from the mean of the steps' by its own and by that mean.
  Eigen::VectorXd together = Eigen::VectorXd::Zero(size);
  Eigen::MatrixXd of_fixed = Eigen::MatrixXd::Zero(size, size);
  for (const OutputErrorProblem::Prior& prior : problem.priors()) {
    const bool fixed = !free[static_cast<std::size_t>(prior.parameter)];
    if (fixed && prior.parameter >= shared_parameter_count) {
      const Eigen::VectorXd cross = bread.col(prior.parameter)(active);
      const Eigen::VectorXd moved = prior.deviation * (inverse_bread * cross);
      of_fixed += moved * moved.transpose();
      together += moved;
    }
  }
  if (!problem.ages().empty()) {
    of_fixed += together * together.transpose() / static_cast<double>(problem.ages().size());
  }
  const double blocks_left = std::max(1.0, static_cast<double>(blocks) - static_cast<double>(size));
  result.few_blocks = static_cast<double>(blocks) / blocks_left;
  for (std::size_t k = 0; k < middles.size(); ++k) {
    const bool of_blocks = k == 1 && noise == nullptr;
    const Eigen::MatrixXd covariance = inverse_bread * middles[k](active, active) * inverse_bread *
                                       (of_blocks ? result.few_blocks : 1.0);
    result.estimates[k](active, active) = covariance + of_fixed;
  }
  return result;
}

}  // namespace flyball::identification