#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense_reduction.hpp"
#include "optimization/evaluation.hpp"

namespace flyball::optimization {

namespace {

VectorXd or_all(const VectorXd& given, Index n, double otherwise) {
  return given.size() == 0 ? VectorXd(VectorXd::Constant(n, otherwise)) : given;
}

Expected<void> check_size(const VectorXd& values, Index n, std::string_view where,
                          std::string_view name) {
  return values.size() == 0 ? Expected<void>()
                            : check_shape(values, n, 1, where, name, "parameters x 1");
}

}  // namespace

std::string name_of(const LeastSquaresProblem& problem, Eigen::Index parameter) {
  const auto place = static_cast<std::size_t>(parameter);
  return place < problem.names.size() ? problem.names[place]
                                      : detail::format("parameter {}", parameter + 1);
}

Expected<void> check_problem(const LeastSquaresProblem& problem, std::string_view where) {
  const Index n = problem.start.size();
  if (n == 0) {
    return refusal(ArgumentError::empty, where, "start").got("empty").expected("parameters x 1");
  }
  FLYBALL_CHECK(Checks(where)
                    .finite(problem.start, "start")
                    .also([&] { return check_size(problem.lower, n, where, "lower"); })
                    .also([&] { return check_size(problem.upper, n, where, "upper"); })
                    .also([&] { return check_size(problem.prior_std, n, where, "prior_std"); })
                    .also([&] { return check_size(problem.prior_mean, n, where, "prior_mean"); })
                    .positive(problem.loss.scale, "loss.scale"));
  if (problem.prior_mean.size() != problem.prior_std.size()) {
    return refusal(ArgumentError::wrong_shape, where, "prior_mean")
        .got(detail::format("of {} entries, prior_std of {}", problem.prior_mean.size(),
                            problem.prior_std.size()))
        .expected("as long as prior_std");
  }
  for (Index i = 0; i < n; ++i) {
    const double low = problem.lower.size() == 0 ? -infinity : problem.lower(i);
    const double high = problem.upper.size() == 0 ? infinity : problem.upper(i);
    if (!(low <= high) || low == infinity || high == -infinity) {
      return refusal(ArgumentError::out_of_range, where, name_of(problem, i))
          .got(detail::format("bounded by {} and {}", format_number(low), format_number(high)))
          .expected("bounded by two numbers of which the first is not larger")
          .with("parameter", static_cast<double>(i));
    }
    if (problem.prior_std.size() != 0 &&
        (!(problem.prior_std(i) > 0.0) ||
         (problem.prior_std(i) != infinity && !std::isfinite(problem.prior_mean(i))))) {
      return refusal(ArgumentError::out_of_range, where,
                     detail::format("the prior of {}", name_of(problem, i)))
          .got(detail::format("{} ± {}", format_number(problem.prior_mean(i)),
                              format_number(problem.prior_std(i))))
          .expected("a finite mean with a positive standard deviation")
          .with("parameter", static_cast<double>(i));
    }
  }
  Index count = (problem.prior_std.array() != infinity).count();
  for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
    if (problem.blocks[b] == nullptr || problem.blocks[b]->size() < 0) {
      return refusal(ArgumentError::empty, where, detail::format("block {}", b + 1))
          .got("null")
          .expected("a block of residuals");
    }
    count += problem.blocks[b]->size();
    std::vector<Index> places = problem.blocks[b]->parameters();
    std::sort(places.begin(), places.end());
    if (std::adjacent_find(places.begin(), places.end()) != places.end() ||
        (!places.empty() && (places.front() < 0 || places.back() >= n))) {
      return refusal(ArgumentError::out_of_range, where,
                     detail::format("block {}'s list of parameters", b + 1))
          .expected(detail::format("of places from 0 to {}, each once", n - 1));
    }
  }
  if (count == 0) {
    return refusal(LeastSquaresError::no_residuals, where, "the problem")
        .got("without a residual and without a prior")
        .hint("give it data");
  }
  return {};
}

Evaluator::Evaluator(const LeastSquaresProblem& problem)
    : problem_(problem),
      lower_(or_all(problem.lower, problem.start.size(), -infinity)),
      upper_(or_all(problem.upper, problem.start.size(), infinity)),
      local_(static_cast<std::size_t>(problem.start.size()), 0) {
  std::vector<int> uses(local_.size(), 0);
  for (const auto& block : problem.blocks) {
    residuals_ += block->size();
    for (const Index place : block->parameters()) {
      ++uses[static_cast<std::size_t>(place)];
    }
  }
  for (std::size_t i = 0; i < local_.size() && problem.blocks.size() > 1; ++i) {
    local_[i] = uses[i] == 1;
  }
}

bool Evaluator::has_prior(Index parameter) const noexcept {
  return problem_.prior_std.size() != 0 && problem_.prior_std(parameter) != infinity;
}

bool Evaluator::evaluate(std::size_t b, const VectorXd& x, bool with_jacobian) {
  const ResidualBlock& block = *problem_.blocks[b];
  const auto count = static_cast<Index>(block.parameters().size());
  own_.resize(count);
  for (Index i = 0; i < count; ++i) {
    own_(i) = x(block.parameters()[static_cast<std::size_t>(i)]);
  }
  r_.resize(block.size());
  if (with_jacobian) {
    J_.setZero(block.size(), count);
  }
  failed_block = b;
  failed_residual = -1;
  if (!block.evaluate(own_, r_, with_jacobian ? &J_ : nullptr)) {
    return false;
  }
  for (Index i = 0; i < r_.size(); ++i) {
    if (!std::isfinite(r_(i)) || (with_jacobian && !J_.row(i).allFinite())) {
      failed_residual = i;
      return false;
    }
  }
  return true;
}

std::optional<double> Evaluator::cost(const VectorXd& x) {
  double sum = 0.0;
  const bool defined = each(x, false, [&](std::size_t, const VectorXd& r, const MatrixXd&) {
    if (problem_.loss.kind == Loss::squared) {
      sum += r.squaredNorm();
      return;
    }
    for (const double residual : r) {
      sum += problem_.loss(residual * residual).value;
    }
  });
  for (Index i = 0; i < x.size(); ++i) {
    if (has_prior(i)) {
      const double deviation = (x(i) - problem_.prior_mean(i)) / problem_.prior_std(i);
      sum += deviation * deviation;
    }
  }
  return defined && std::isfinite(sum) ? std::optional(sum) : std::nullopt;
}

std::optional<ArrowSystem> Evaluator::linearize(const VectorXd& x, double& cost) {
  ArrowSystem system;
  system.parameters = parameters();
  std::vector<Index> column(local_.size(), -1);  // of a shared parameter in the root
  for (Index i = 0; i < system.parameters; ++i) {
    if (!is_local(i)) {
      column[static_cast<std::size_t>(i)] = static_cast<Index>(system.root.shared.size());
      system.root.shared.push_back(i);
    }
  }
  const auto width = static_cast<Index>(system.root.shared.size()) + 1;
  system.root.T.resize(0, width);
  cost = 0.0;
  const auto prior_row = [&](Index parameter, auto&& row, Index at) {
    const double sigma = problem_.prior_std(parameter);
    const double deviation = (x(parameter) - problem_.prior_mean(parameter)) / sigma;
    row(at) = 1.0 / sigma;
    row(row.size() - 1) = deviation;
    cost += deviation * deviation;
  };
  const bool defined = each(x, true, [&](std::size_t b, const VectorXd& r, const MatrixXd& J) {
    const std::vector<Index>& places = problem_.blocks[b]->parameters();
    ArrowBlock block;
    for (const Index place : places) {
      (is_local(place) ? block.local : block.shared).push_back(place);
    }
    const bool own = !block.local.empty();
    const auto locals = static_cast<Index>(block.local.size());
    const Index columns = own ? static_cast<Index>(places.size()) + 1 : width;
    const Index priors = std::count_if(block.local.begin(), block.local.end(),
                                       [&](Index place) { return has_prior(place); });
    const Index above = own ? 0 : system.root.T.rows();
    MatrixXd M = MatrixXd::Zero(above + r.size() + priors, columns);
    Index next_local = 0;
    Index next_shared = locals;
    for (std::size_t c = 0; c < places.size(); ++c) {
      const Index to = !own                  ? column[static_cast<std::size_t>(places[c])]
                       : is_local(places[c]) ? next_local++
                                             : next_shared++;
      M.col(to).segment(above, r.size()) = J.col(static_cast<Index>(c));
    }
    M.rightCols(1).middleRows(above, r.size()) = r;
    for (Index i = 0; i < r.size(); ++i) {
      const LossValue loss = problem_.loss(r(i) * r(i));
      cost += loss.value;
      if (loss.slope == 1.0 && loss.bend == 0.0) {
        continue;
      }
      // Jᵀr keeps ρ', JᵀJ gets ρ' + 2 s ρ'', but not less than a twentieth of ρ'.
      constexpr double least = 0.05;
      const double share = loss.slope > 0.0
                               ? std::max(least, 1.0 + 2.0 * r(i) * r(i) * loss.bend / loss.slope)
                               : 1.0;
      const double slope = std::sqrt(loss.slope);
      M.row(above + i).head(columns - 1) *= slope * std::sqrt(share);
      M(above + i, columns - 1) *= slope / std::sqrt(share);
    }
    Index row = above + r.size();
    for (Index i = 0; i < locals; ++i) {
      if (const Index place = block.local[static_cast<std::size_t>(i)]; has_prior(place)) {
        prior_row(place, M.row(row++), i);
      }
    }
    if (!own) {
      M.topRows(above) = system.root.T;
      system.root.T = detail::triangle_of(M);
    } else {
      block.T = detail::triangle_of(M);
      system.blocks.push_back(std::move(block));
    }
  });
  if (!defined) {
    return std::nullopt;
  }
  for (Index i = 0; i < system.parameters; ++i) {
    if (has_prior(i) && !is_local(i)) {
      system.root.T.conservativeResize(system.root.T.rows() + 1, width);
      system.root.T.bottomRows(1).setZero();
      prior_row(i, system.root.T.row(system.root.T.rows() - 1),
                column[static_cast<std::size_t>(i)]);
    }
  }
  summarize(system);
  const bool finite = std::isfinite(cost) && std::isfinite(system.square) &&
                      system.column_norms.allFinite() && system.half_gradient.allFinite();
  return finite ? std::optional(std::move(system)) : std::nullopt;
}

std::vector<Bound> bounds_at(const Evaluator& evaluator, const VectorXd& x,
                             const VectorXd& half_gradient) {
  std::vector<Bound> all(static_cast<std::size_t>(x.size()), Bound::none);
  for (Index i = 0; i < x.size(); ++i) {
    const double low = evaluator.lower()(i);
    const double high = evaluator.upper()(i);
    all[static_cast<std::size_t>(i)] = low == high                               ? Bound::fixed
                                       : x(i) == low && half_gradient(i) >= 0.0  ? Bound::lower
                                       : x(i) == high && half_gradient(i) <= 0.0 ? Bound::upper
                                                                                 : Bound::none;
  }
  return all;
}

void describe(const Evaluator& evaluator, const ArrowSystem& system, double rank_tolerance,
              LeastSquaresResult& result) {
  const VectorXd& x = result.x;
  result.residuals = evaluator.residuals();
  result.bounds = bounds_at(evaluator, x, system.half_gradient);
  std::vector<char> free;
  for (const Bound bound : result.bounds) {
    free.push_back(bound == Bound::none);
    result.free += free.back();
  }
  const ArrowRank rank = rank_of(system, free, rank_tolerance);
  result.rank = rank.rank;
  result.undetermined = rank.undetermined;
  result.reciprocal_condition = rank.reciprocal_condition;
  const VectorXd& norms = system.column_norms;
  result.scales = (norms.array() > 0.0).select(norms.cwiseInverse(), 0.0);
  result.projected_gradient = 0.0;
  for (Index i = 0; i < x.size() && result.cost > 0.0; ++i) {
    if (norms(i) > 0.0) {
      const double moved = std::clamp(x(i) - system.half_gradient(i) / (norms(i) * norms(i)),
                                      evaluator.lower()(i), evaluator.upper()(i));
      result.projected_gradient =
          std::max(result.projected_gradient, norms(i) * std::abs(moved - x(i)));
    }
  }
  result.projected_gradient /= result.cost > 0.0 ? std::sqrt(result.cost) : 1.0;
}

}  // namespace flyball::optimization
