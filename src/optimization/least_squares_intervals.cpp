#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <flyball/core/argument.hpp>
#include <flyball/core/random.hpp>
#include <flyball/math/probability/distributions.hpp>
#include <flyball/optimization/least_squares_statistics.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "optimization/evaluation.hpp"

namespace flyball::optimization {

namespace {

/// The least cost with one parameter at a value, from the point where it last was.
class Profile {
 public:
  Profile(const LeastSquaresProblem& problem, const LeastSquaresResult& result, Index parameter,
          const LeastSquaresOptions& options)
      : problem_(problem), minimum_(result), parameter_(parameter), options_(options) {
    const Evaluator evaluator(problem);
    problem_.lower = evaluator.lower();
    problem_.upper = evaluator.upper();
    problem_.start = result.x;
    low_ = problem_.lower(parameter);
    high_ = problem_.upper(parameter);
  }

  /// √(rise of the cost); negative, where the cost is lower than the minimum: found a better one.
  Expected<double> rise(double value) {
    problem_.lower(parameter_) = problem_.upper(parameter_) = value;
    FLYBALL_TRY(const auto fit, solve_least_squares(problem_, options_));
    problem_.start = fit.x;
    const double rise = fit.cost - minimum_.cost;
    if (rise < -1e-9 * minimum_.cost && (!better_ || fit.cost < better_cost_)) {
      better_ = fit.x;
      better_cost_ = fit.cost;
    }
    return std::sqrt(std::max(0.0, rise));
  }
  void restart() { problem_.start = minimum_.x; }

  [[nodiscard]] double low() const noexcept { return low_; }
  [[nodiscard]] double high() const noexcept { return high_; }
  [[nodiscard]] const std::optional<VectorXd>& better() const noexcept { return better_; }

 private:
  LeastSquaresProblem problem_;
  const LeastSquaresResult& minimum_;
  Index parameter_;
  LeastSquaresOptions options_;
  double low_ = 0.0;
  double high_ = 0.0;
  std::optional<VectorXd> better_{};
  double better_cost_ = 0.0;
};

struct End {
  double value = 0.0;
  bool open = false;
};

/// Where the profile rises to `target` on one side. @param step  Signed first guess of it.
Expected<End> end_of(Profile& profile, double from, double step, double target) {
  const double limit = step > 0.0 ? profile.high() : profile.low();
  if (from == limit) {
    return End{limit, true};
  }
  profile.restart();
  double inner = from;
  double inner_rise = 0.0;
  double outer = from;
  double outer_rise = 0.0;
  for (int i = 0;; ++i) {
    const bool last = step > 0.0 ? from + step >= limit : from + step <= limit;
    outer = last ? limit : from + step;
    auto rise = profile.rise(outer);
    if (!rise) {  // The residuals end before there: nearer.
      if (i > 40) {
        return End{inner, true};
      }
      step = 0.5 * (inner - from + step);
      continue;
    }
    outer_rise = *rise;
    if (outer_rise >= target) {
      break;
    }
    if (last || i > 30) {
      return End{last ? limit : step * infinity, true};
    }
    // The root of the rise is nearly straight; where it flattens, the stride grows.
    step *= outer_rise > 0.0 ? std::clamp(1.2 * target / outer_rise, 1.2, 4.0) : 4.0;
    inner = outer;
    inner_rise = outer_rise;
  }
  for (int i = 0; i < 60 && outer_rise - inner_rise > 1e-9 * target; ++i) {
    const double share = (target - inner_rise) / (outer_rise - inner_rise);
    const double at = inner + std::clamp(share, 0.05, 0.95) * (outer - inner);
    FLYBALL_TRY(const double rise, profile.rise(at));
    if (std::abs(rise - target) <= 1e-4 * target || at == inner || at == outer) {
      return End{at, false};
    }
    (rise < target ? inner : outer) = at;
    (rise < target ? inner_rise : outer_rise) = rise;
  }
  return End{outer, false};
}

}  // namespace

Expected<ProfileInterval> profile_interval(const LeastSquaresProblem& problem,
                                           const LeastSquaresResult& result, Index parameter,
                                           const ProfileOptions& options) {
  constexpr std::string_view where = "profile_interval";
  FLYBALL_CHECK(Checks(where)
                    .within(static_cast<double>(parameter), 0.0,
                            static_cast<double>(problem.start.size()) - 1.0, "parameter")
                    .within(options.confidence, 1e-6, 1.0 - 1e-9, "confidence"));
  FLYBALL_TRY(const auto covariance, covariance_of(problem, result, options.covariance));
  CovarianceOptions plain = options.covariance;
  plain.batch = problem.loss.kind == Loss::squared ? 0 : 1;
  FLYBALL_TRY(const auto independent, covariance_of(problem, result, plain));
  const double freedom = options.covariance.scale_is_known ? infinity : covariance.freedom;
  const double t = student_quantile(0.5 + 0.5 * options.confidence, freedom);
  const double error = covariance.standard_errors(parameter);
  const double wider = std::isfinite(error) && independent.standard_errors(parameter) > 0.0
                           ? error / independent.standard_errors(parameter)
                           : 1.0;
  const double target = t * covariance.sigma * wider;
  const double at = result.x(parameter);
  const double step = std::isfinite(error) && error > 0.0 ? t * error
                      : result.scales(parameter) > 0.0    ? target * result.scales(parameter)
                                                          : std::max(1e-6, 0.1 * std::abs(at));
  Profile profile(problem, result, parameter, options.fit);
  FLYBALL_TRY(const End low, end_of(profile, at, -step, target));
  FLYBALL_TRY(const End high, end_of(profile, at, step, target));
  return ProfileInterval{low.value, high.value, low.open, high.open, profile.better()};
}

namespace {

/// A block whose residuals are shifted.
class ShiftedBlock final : public ResidualBlock {
 public:
  ShiftedBlock(std::shared_ptr<const ResidualBlock> block, VectorXd shift)
      : ResidualBlock(block->size(), block->parameters()),
        block_(std::move(block)),
        shift_(std::move(shift)) {}

  [[nodiscard]] bool evaluate(const VectorXd& x, VectorXd& r, MatrixXd* J) const override {
    const bool defined = block_->evaluate(x, r, J);
    r += shift_;
    return defined;
  }

 private:
  std::shared_ptr<const ResidualBlock> block_;
  VectorXd shift_;
};

}  // namespace

VectorXd Bootstrap::quantile(double share) const {
  VectorXd made(x.rows());
  for (Index i = 0; i < x.rows(); ++i) {
    VectorXd row = x.row(i);
    std::sort(row.begin(), row.end());
    const double place = std::clamp(share, 0.0, 1.0) * static_cast<double>(row.size() - 1);
    const auto below = static_cast<Index>(place);
    const Index above = std::min(below + 1, row.size() - 1);
    made(i) = row.size() == 0
                  ? std::numeric_limits<double>::quiet_NaN()
                  : row(below) + (place - static_cast<double>(below)) * (row(above) - row(below));
  }
  return made;
}

Expected<Bootstrap> bootstrap(const LeastSquaresProblem& problem, const LeastSquaresResult& result,
                              const BootstrapOptions& options) {
  constexpr std::string_view where = "bootstrap";
  FLYBALL_CHECK(check_problem(problem, where));
  FLYBALL_CHECK(Checks(where)
                    .shape(result.x, problem.start.size(), 1, "result.x", "parameters x 1")
                    .within(options.samples, 1.0, 1e6, "samples")
                    .within(static_cast<double>(options.batch), 1.0, 1e15, "batch"));
  std::vector<VectorXd> residuals;
  Evaluator evaluator(problem);
  if (!evaluator.each(result.x, false, [&](std::size_t, const VectorXd& r, const MatrixXd&) {
        residuals.push_back(r);
      })) {
    return refusal(LeastSquaresError::no_start, where, "result.x")
        .got("a point where the residuals are not finite");
  }
  Random random(options.seed);
  Bootstrap made;
  std::vector<VectorXd> samples;
  for (int k = 0; k < options.samples; ++k) {
    LeastSquaresProblem drawn = problem;
    drawn.start = result.x;
    for (std::size_t b = 0; b < residuals.size(); ++b) {
      const VectorXd& r = residuals[b];
      const double mean = r.size() == 0 ? 0.0 : r.mean();
      const Index batch = std::min(options.batch, r.size());
      VectorXd shift = -r;
      for (Index first = 0; first < r.size(); first += batch) {
        const auto from =
            static_cast<Index>(random.uniform() * static_cast<double>(r.size() - batch + 1));
        for (Index i = 0; i < std::min(batch, r.size() - first); ++i) {
          shift(first + i) += r(from + i) - mean;
        }
      }
      drawn.blocks[b] = std::make_shared<ShiftedBlock>(problem.blocks[b], std::move(shift));
    }
    const auto fit = solve_least_squares(drawn, options.fit);
    if (fit && fit->converged) {
      samples.push_back(fit->x);
    } else {
      ++made.failed;
    }
  }
  made.x.resize(problem.start.size(), static_cast<Index>(samples.size()));
  for (std::size_t k = 0; k < samples.size(); ++k) {
    made.x.col(static_cast<Index>(k)) = samples[k];
  }
  return made;
}

}  // namespace flyball::optimization
