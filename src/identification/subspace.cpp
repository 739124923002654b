#include <flyball/identification/subspace.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include <flyball/identification/identification_error.hpp>
#include <flyball/math/riccati/riccati.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/subspace_data.hpp"
#include "identification/subspace_states.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/panels.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::string_view in_fit_subspace = "fit_subspace";

MatrixXd lower_solve(const MatrixXd& J, const MatrixXd& right) {
  return J.triangularView<Eigen::Lower>().solve(right);
}

/// Bauer's criterion over the canonical correlations, or the gaps of exact data.
VectorXd order_criterion(const VectorXd& values, bool correlations, Index most, const Parts& parts,
                         Index samples) {
  VectorXd criterion(most + 1);
  const auto N = static_cast<double>(samples);
  for (Index n = 0; n <= most; ++n) {
    const double left = n < values.size() ? values(n) : 0.0;
    if (correlations) {
      const auto cost = static_cast<double>(n * (2 * parts.p + parts.m));
      criterion(n) = left * left + cost * std::log(N) / N;
    } else {
      const double floor = 1e-12 * values(0);
      criterion(n) = n == 0 ? 1.0 : (left + floor) / (values(n - 1) + floor);
    }
  }
  return criterion;
}

struct NoiseGain {
  MatrixXd K;
  MatrixXd noise;
  bool determined = false;
};

/// The steady predictor of x⁺ = A x + w, y = C x + v with the covariance of [w; v].
NoiseGain noise_gain(const MatrixXd& A, const MatrixXd& C, const MatrixXd& covariance) {
  const Index n = A.rows();
  const Index p = C.rows();
  const MatrixXd R = covariance.bottomRightCorner(p, p);
  if (R.diagonal().minCoeff() > 1e-18) {
    const auto riccati = dare(A.transpose(), C.transpose(), covariance.topLeftCorner(n, n), R,
                              covariance.topRightCorner(n, p));
    if (riccati) {
      return {riccati->K.transpose(), detail::symmetrized(R + C * riccati->X * C.transpose()),
              true};
    }
  }
  // Any stable predictor serves where there is no noise to tell the best one; none for a stable A.
  const Eigen::VectorXcd modes = detail::eigenvalues_of(A);
  NoiseGain gain{MatrixXd::Zero(n, p), R, false};
  if (!(modes.cwiseAbs().maxCoeff() < 1.0)) {
    const auto observer =
        dare(A.transpose(), C.transpose(), MatrixXd::Identity(n, n), MatrixXd::Identity(p, p));
    if (observer) {
      gain.K = observer->K.transpose();
    }
  }
  return gain;
}

/// Poles outside the unit circle go to where they are as far inside.
MatrixXd reflected(const MatrixXd& A) {
  const detail::Eigensystem modes = detail::eigensystem_of(A);
  if (!modes.values.allFinite() || modes.values.cwiseAbs().maxCoeff() < 1.0) {
    return A;
  }
  Eigen::VectorXcd values = modes.values;
  for (std::complex<double>& value : values) {
    const double size = std::abs(value);
    if (size >= 1.0) {
      value *= std::min(1.0 / size, 1.0 - 1e-6) / size;
    }
  }
  // A V = V Λ: the transposed equation Vᵀ Aᵀ = Λ Vᵀ.
  return detail::solve_complex(modes.vectors.transpose(),
                               values.asDiagonal() * modes.vectors.transpose())
      .transpose()
      .real();
}

/// The model of A and C: its gain by what they leave of the future, B, D and x0 by the whole
/// record; in the record's units.
Expected<InnovationsModel> complete(const ScaledSignals& record, const StateSequence& states,
                                    Index columns, const MatrixXd& A, Time period,
                                    const SubspaceOptions& options, bool& noise_determined) {
  const MatrixXd& C = states.C;
  const Index n = A.rows();
  const Index m = record.inputs;
  const Index p = C.rows();
  MatrixXd dynamics(n + p, n);
  dynamics << A, C;
  MatrixXd left = states.target;
  detail::add_product(-1.0, dynamics, states.X, left.leftCols(states.X.cols()));
  MatrixXd covariance = MatrixXd::Zero(n + p, n + p);
  detail::add_product_transposed(1.0 / static_cast<double>(columns), left, left, covariance);
  covariance = detail::symmetrized(covariance);
  const NoiseGain gain = noise_gain(A, C, covariance);
  noise_determined = gain.determined;
  InnovationsModel model;
  model.system = {A, MatrixXd::Zero(n, m), C, MatrixXd::Zero(p, m), period};
  model.K = gain.K;
  model.x0 = VectorXd::Zero(n);
  model.noise = gain.noise;

  MatrixXd W = MatrixXd::Identity(p, p);
  if (gain.determined) {
    if (const auto factor = detail::cholesky_of(gain.noise)) {
      W = lower_solve(*factor, W);
    }
  }
  FLYBALL_TRY(const VectorXd inputs, regress_inputs(record, model, W, options, gain.determined));
  const Index start = options.initial_state ? n : 0;
  if (start > 0) {
    model.x0 = inputs.head(n);
  }
  for (Index j = 0; j < m; ++j) {
    model.system.B.col(j) = inputs.segment(start + j * n, n);
    if (options.feedthrough) {
      model.system.D.col(j) = inputs.segment(start + n * m + j * p, p);
    }
  }
  return model;
}

bool is_stable(const MatrixXd& A) {
  // A power of less than norm 1 tells sooner than the eigenvalues do.
  MatrixXd power = A;
  for (int doubling = 0; doubling < 12; ++doubling) {
    const double size = power.squaredNorm();
    if (size < 1.0) {
      return true;
    }
    if (!(size < 1e100)) {
      break;
    }
    MatrixXd square = MatrixXd::Zero(A.rows(), A.cols());
    detail::add_product(1.0, power, power, square);
    power.swap(square);
  }
  return detail::eigenvalues_of(A).cwiseAbs().maxCoeff() < 1.0;
}

/// -2 log likelihood of normal errors one sample ahead, but for a constant; infinite where the
/// predictor is of no use.
double misfit(const ScaledSignals& record, const InnovationsModel& model) {
  const auto samples = static_cast<double>(record.samples());
  const MatrixXd squares = prediction_squares(record, model);
  if (!squares.allFinite()) {
    return std::numeric_limits<double>::infinity();
  }
  const auto L = detail::cholesky_of(squares / samples);
  return L ? 2.0 * samples * L->diagonal().array().log().sum()
           : std::numeric_limits<double>::infinity();
}

Expected<void> check(const MatrixRef& u, const MatrixRef& y, Time period,
                     const SubspaceOptions& options) {
  FLYBALL_CHECK(Checks(in_fit_subspace)
                    .finite(u, "u")
                    .shape(y, u.rows(), y.cols(), "y", "samples of u x outputs")
                    .finite(y, "y")
                    .positive(period.si(), "period", "s"));
  if (u.cols() == 0 || y.cols() == 0) {
    return refusal(ArgumentError::empty, in_fit_subspace, u.cols() == 0 ? "u" : "y")
        .expected("samples x signals");
  }
  struct Range {
    Index value;
    const char* name;
    Index least;
    bool given;
  };
  // One block row of the future is what the next one is told by: there must be two.
  for (const Range& range :
       {Range{options.order.value_or(0), "order", 1, options.order.has_value()},
        Range{options.most_order, "most_order", 1, options.most_order != 0},
        Range{options.block_rows, "block_rows", 2, options.block_rows != 0}}) {
    if (range.given && (range.value < range.least || range.value > 200)) {
      return refusal(ArgumentError::out_of_range, in_fit_subspace, range.name)
          .got(std::to_string(range.value))
          .expected(detail::format("from {} to 200", range.least));
    }
  }
  return {};
}

}  // namespace

Expected<SubspaceFit> fit_subspace(const MatrixRef& u, const MatrixRef& y, Time period,
                                   const SubspaceOptions& options) {
  FLYBALL_CHECK(check(u, y, period, options));
  const Index m = u.cols();
  const Index p = y.cols();
  const Index samples = u.rows();
  const Index wanted =
      options.order.value_or(options.most_order > 0 ? options.most_order : Index{10});
  // Γ without a block row must still show every state.
  const Index least = wanted / p + 2;
  const Index most = (samples + 1) / (2 * (m + p) + 3);
  const Index s = options.block_rows > 0 ? options.block_rows
                                         : std::clamp<Index>(std::max<Index>(15, least + 3), 2,
                                                             std::max<Index>(2, most));
  if (s > most || (options.order && s < least)) {
    return refusal(IdentificationError::too_short, in_fit_subspace)
        .hint(s > most ? "record more samples, or take a smaller order"
                       : "take more block rows, or a smaller order")
        .with("samples", static_cast<double>(samples))
        .with("block rows", static_cast<double>(s))
        .with("needed block rows", static_cast<double>(least));
  }
  const ScaledSignals record = scaled(u, y);
  const PastAndFuture data = compress(record, s);
  const Parts parts{m, p, s, data};
  const VectorXd excitation = data.L.topLeftCorner(s * m, s * m).diagonal().cwiseAbs();
  if (excitation.minCoeff() <= 1e-9 * std::sqrt(static_cast<double>(data.columns))) {
    return refusal(IdentificationError::singular, in_fit_subspace)
        .hint("excite every input with more frequencies, or take fewer block rows")
        .with("block rows", static_cast<double>(s));
  }
  const Index largest = std::min<Index>(wanted, (s - 1) * p);
  const Observed observed = observe(parts, options.weighting, largest);

  SubspaceFit fit;
  fit.block_rows = s;
  fit.singular_values = observed.values;
  fit.criterion = order_criterion(observed.correlations, observed.noisy, largest, parts, samples);
  fit.order = largest;
  if (!options.order) {
    fit.criterion.tail(largest).minCoeff(&fit.order);
    ++fit.order;
  }
  const StateSequence states = states_of(parts, observed, options.weighting, fit.order);

  InnovationsModel& model = fit.model;
  const bool unstable = !is_stable(states.A);
  FLYBALL_TRY(model, complete(record, states, data.columns,
                              unstable && options.stable ? reflected(states.A) : states.A, period,
                              options, fit.noise_determined));
  if (unstable && !options.stable) {
    // A stable plant's pole near the circle may come out beyond it, and its free run then grows:
    // such a pole stays only where the record is predicted worse without.
    bool determined = false;
    FLYBALL_TRY(InnovationsModel inside, complete(record, states, data.columns, reflected(states.A),
                                                  period, options, determined));
    constexpr double clearly = 12.0;  // χ², of about as many states
    if (misfit(record, inside) < misfit(record, model) + clearly) {
      model = std::move(inside);
      fit.noise_determined = determined;
      fit.stabilized = true;
    }
  }

  const VectorXd u_unit = record.unit.head(m);
  const VectorXd y_unit = record.unit.tail(p);
  model.system.B *= u_unit.cwiseInverse().asDiagonal();
  model.system.C = y_unit.asDiagonal() * model.system.C;
  model.system.D = y_unit.asDiagonal() * model.system.D * u_unit.cwiseInverse().asDiagonal();
  model.K *= y_unit.cwiseInverse().asDiagonal();
  model.noise = y_unit.asDiagonal() * model.noise * y_unit.asDiagonal();
  return fit;
}

}  // namespace flyball::identification
