#include <flyball/optimization/least_squares_statistics.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "optimization/evaluation.hpp"

namespace flyball::optimization {

namespace {

/// A⁻¹ of an upper triangle without zeros on its diagonal.
MatrixXd inverse_of(const MatrixXd& R) {
  return R.rows() == 0 ? R
                       : flyball::detail::solve_linear(R, MatrixXd::Identity(R.rows(), R.cols()));
}

/// The columns of factors put back in their places, without inverting more than triangles.
class Inverse {
 public:
  Inverse(const Evaluator& evaluator, const ArrowSystem& system, const std::vector<char>& free)
      : system_(system) {
    const VectorXd D = (system.column_norms.array() > 0.0).select(system.column_norms, 1.0);
    constexpr double damping = 1e-24;
    factors_ = factor(system, free, VectorXd::Zero(system.parameters), damping, D);
    inverse_ = inverse_of(factors_.R);
    shared_ = inverse_ * inverse_.transpose();
    block_of_.assign(evaluator.problem().blocks.size(), npos);
    std::size_t next = 0;
    for (std::size_t b = 0; b < block_of_.size(); ++b) {
      const auto& places = evaluator.problem().blocks[b]->parameters();
      if (std::any_of(places.begin(), places.end(),
                      [&](Index place) { return evaluator.is_local(place); })) {
        block_of_[b] = next++;
      }
    }
  }

  [[nodiscard]] const MatrixXd& shared() const noexcept { return shared_; }
  [[nodiscard]] const std::vector<Index>& places() const noexcept { return factors_.shared; }

  /// Variances of every free parameter for residuals of variance 1.
  [[nodiscard]] VectorXd variances() const {
    VectorXd all = VectorXd::Zero(system_.parameters);
    put(all, shared_.diagonal());
    for (const ArrowFactors::Local& block : factors_.blocks) {
      const MatrixXd inverse = inverse_of(block.R_ll);
      const MatrixXd W = following(block, inverse) * inverse_;
      for (std::size_t i = 0; i < block.local.size(); ++i) {
        const auto row = static_cast<Index>(i);
        all(block.local[i]) = inverse.row(row).squaredNorm() + W.row(row).squaredNorm();
      }
    }
    return all;
  }

  /// The same of the sandwich. @param scores  For each batch its block and its half gradient
  ///                                          (n x 1, zero beside the block's parameters).
  template <class Scores>
  [[nodiscard]] VectorXd sandwich(const Scores& scores, MatrixXd& shared) const {
    const Index n = system_.parameters;
    const auto count = static_cast<Index>(factors_.shared.size());
    // What each batch does to the shared parameters: C (S_s - H_sl H_ll⁻¹ S_l).
    std::vector<MatrixXd> of_block(factors_.blocks.size(), MatrixXd::Zero(count, count));
    std::vector<MatrixXd> inverses;
    std::vector<MatrixXd> W;
    for (const ArrowFactors::Local& block : factors_.blocks) {
      inverses.push_back(inverse_of(block.R_ll));
      W.push_back(following(block, inverses.back()));
    }
    shared = MatrixXd::Zero(count, count);
    VectorXd own = VectorXd::Zero(n);
    scores([&](std::size_t b, const VectorXd& score) {
      VectorXd s(count);
      for (Index j = 0; j < count; ++j) {
        s(j) = score(factors_.shared[static_cast<std::size_t>(j)]);
      }
      const std::size_t k = block_of_[b];
      VectorXd local;
      if (k != npos) {
        local = picked(score, factors_.blocks[k].local);
        s -= W[k].transpose() * local;
      }
      const VectorXd move = shared_ * s;
      shared.noalias() += move * move.transpose();
      if (k != npos) {
        of_block[k].noalias() += move * move.transpose();
        const VectorXd own_move = inverses[k] * (inverses[k].transpose() * local) - W[k] * move;
        for (std::size_t i = 0; i < factors_.blocks[k].local.size(); ++i) {
          own(factors_.blocks[k].local[i]) +=
              own_move(static_cast<Index>(i)) * own_move(static_cast<Index>(i));
        }
      }
    });
    VectorXd all = own;
    put(all, shared.diagonal());
    for (std::size_t k = 0; k < factors_.blocks.size(); ++k) {
      const MatrixXd others = W[k] * (shared - of_block[k]) * W[k].transpose();
      for (std::size_t i = 0; i < factors_.blocks[k].local.size(); ++i) {
        all(factors_.blocks[k].local[i]) += others(static_cast<Index>(i), static_cast<Index>(i));
      }
    }
    return all;
  }

 private:
  static constexpr auto npos = static_cast<std::size_t>(-1);

  static VectorXd picked(const VectorXd& all, const std::vector<Index>& places) {
    VectorXd some(static_cast<Index>(places.size()));
    for (std::size_t i = 0; i < places.size(); ++i) {
      some(static_cast<Index>(i)) = all(places[i]);
    }
    return some;
  }
  void put(VectorXd& all, const VectorXd& shared) const {
    for (std::size_t j = 0; j < factors_.shared.size(); ++j) {
      all(factors_.shared[j]) = shared(static_cast<Index>(j));
    }
  }
  /// R_ll⁻¹ R_ls, its columns those of all shared parameters.
  [[nodiscard]] MatrixXd following(const ArrowFactors::Local& block,
                                   const MatrixXd& inverse) const {
    MatrixXd W = MatrixXd::Zero(inverse.rows(), static_cast<Index>(factors_.shared.size()));
    const MatrixXd some = inverse * block.R_ls;
    for (std::size_t j = 0; j < block.shared.size(); ++j) {
      W.col(block.shared[j]) = some.col(static_cast<Index>(j));
    }
    return W;
  }

  const ArrowSystem& system_;
  ArrowFactors factors_{};
  MatrixXd inverse_{}, shared_{};
  std::vector<std::size_t> block_of_;
};

}  // namespace

Expected<Covariance> covariance_of(const LeastSquaresProblem& problem,
                                   const LeastSquaresResult& result,
                                   const CovarianceOptions& options) {
  constexpr std::string_view where = "covariance_of";
  FLYBALL_CHECK(check_problem(problem, where));
  FLYBALL_CHECK(Checks(where)
                    .shape(result.x, problem.start.size(), 1, "result.x", "parameters x 1")
                    .finite(result.x, "result.x")
                    .within(static_cast<double>(options.batch), 0.0, 1e15, "batch"));
  Evaluator evaluator(problem);
  double cost = 0.0;
  const auto system = evaluator.linearize(result.x, cost);
  if (!system) {
    return refusal(LeastSquaresError::no_start, where, "result.x")
        .got("a point where the residuals are not finite");
  }
  LeastSquaresResult at{.x = result.x, .cost = cost};
  describe(evaluator, *system, LeastSquaresOptions{}.rank_tolerance, at);
  Covariance made;
  made.freedom = static_cast<double>(at.residuals - at.rank);
  if (!options.scale_is_known && !(made.freedom > 0.0)) {
    return refusal(ArgumentError::out_of_range, where, "the number of residuals")
        .got(flyball::detail::format("{}", at.residuals))
        .expected(
            flyball::detail::format("more than the {} parameters that they determine", at.rank))
        .hint("take more data, or fix parameters");
  }
  std::vector<char> free;
  for (const Bound bound : at.bounds) {
    free.push_back(bound == Bound::none);
  }
  const Inverse inverse(evaluator, *system, free);
  made.parameters = inverse.places();
  double squares = 0.0;
  const auto with_gradients = [&](const auto& visit) {
    VectorXd score = VectorXd::Zero(problem.start.size());
    evaluator.each(result.x, true, [&](std::size_t b, const VectorXd& r, const MatrixXd& J) {
      const std::vector<Index>& places = problem.blocks[b]->parameters();
      for (Index first = 0; first < r.size(); first += std::max<Index>(1, options.batch)) {
        const Index count = std::min(std::max<Index>(1, options.batch), r.size() - first);
        VectorXd sum = VectorXd::Zero(J.cols());
        for (Index i = first; i < first + count; ++i) {
          const double pull = problem.loss(r(i) * r(i)).slope * r(i);
          squares += pull * pull;
          sum += pull * J.row(i).transpose();
        }
        score.setZero();
        for (std::size_t c = 0; c < places.size(); ++c) {
          score(places[c]) = sum(static_cast<Index>(c));
        }
        visit(b, score);
      }
    });
  };
  VectorXd variances;
  if (options.batch > 0 || problem.loss.kind != Loss::squared) {
    variances = inverse.sandwich(with_gradients, made.matrix);
    const double correction =
        made.freedom > 0.0 ? static_cast<double>(at.residuals) / made.freedom : 1.0;
    made.matrix *= correction;
    variances *= correction;
  } else {
    with_gradients([](std::size_t, const VectorXd&) {});
    variances = inverse.variances();
    made.matrix = inverse.shared();
  }
  made.sigma = options.scale_is_known ? 1.0 : std::sqrt(squares / made.freedom);
  if (options.batch == 0 && problem.loss.kind == Loss::squared) {
    made.matrix *= made.sigma * made.sigma;
    variances *= made.sigma * made.sigma;
  }
  made.standard_errors = variances.cwiseMax(0.0).cwiseSqrt();
  // The other way round, a parameter of a combination that is not determined is not, either.
  for (Index k = 0; k < at.undetermined.cols(); ++k) {
    for (Index i = 0; i < at.undetermined.rows(); ++i) {
      if (std::abs(at.undetermined(i, k)) > 1e-6) {
        made.standard_errors(i) = infinity;
      }
    }
  }
  return made;
}

}  // namespace flyball::optimization
