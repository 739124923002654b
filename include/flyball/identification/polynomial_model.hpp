#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/identification/innovations_model.hpp>

namespace flyball::identification {

/// A(q) y = Σ B_j(q)/F_j(q) u_j + C(q)/D(q) e, polynomials in the delay q⁻¹ (Ljung's family): ARX
/// has A and B, ARMAX A, B and C, output error B and F, Box-Jenkins B, F, C and D.
///
/// A polynomial is its coefficients of 1, q⁻¹, q⁻², …; A, C, D and F begin with 1, B with as many
/// zeros as the input is late.
struct PolynomialModel {
  Eigen::VectorXd A = Eigen::VectorXd::Ones(1);
  std::vector<Eigen::VectorXd> B{};  ///< One an input.
  Eigen::VectorXd C = Eigen::VectorXd::Ones(1);
  Eigen::VectorXd D = Eigen::VectorXd::Ones(1);
  std::vector<Eigen::VectorXd> F{};  ///< One an input.
  double noise = 0.0;                ///< Variance of e.
  Time period{};
};

/// How many coefficients each polynomial has beside its leading one; B, F and the delay are those
/// of every input.
struct PolynomialOrders {
  int a = 0;
  int b = 1;  ///< Coefficients of B.
  int c = 0;
  int d = 0;
  int f = 0;
  int delay = 1;  ///< Samples between u and the first effect on y; 0 where it is at once.

  friend bool operator==(const PolynomialOrders&, const PolynomialOrders&) = default;
};

/// A fitted model, and how far it is to be trusted.
struct PolynomialFit {
  PolynomialModel model;
  PolynomialOrders orders{};
  Eigen::VectorXd parameters;       ///< a, b of each input, c, d, f of each input.
  Eigen::VectorXd standard_errors;  ///< Infinite for what the data do not tell.
  Eigen::MatrixXd covariance;
  Eigen::VectorXd residuals;    ///< e, of the samples that count (the first ones only start it).
  double prediction_fit = 0.0;  ///< Of y one sample ahead; as `fit_of`.
  double simulation_fit = 0.0;  ///< Of y in free run; -inf where the model is unstable.
  double aic = 0.0;             ///< N ln V + 2 d, with V the mean square of e and d parameters.
  double bic = 0.0;             ///< N ln V + d ln N.
  double mdl = 0.0;             ///< V (1 + d ln N / N).
  /// Largest autocorrelation of e at lags 1 to 25 over what white noise exceeds in 1 of 100
  /// records: above 1 the noise model does not explain the noise.
  double whiteness = 0.0;
  /// The same of e and the inputs' past: above 1 there is more of u in y than the model has.
  double input_independence = 0.0;
  int iterations = 0;
};

/// A model with A and B alone, by linear least squares: normal equations, of whose sums each sample
/// needs few, where they keep more than half of the digits, else QR.
/// @param u  samples x inputs. @param y  samples x 1. @param orders  a, b and delay.
/// @errors ArgumentError for shapes, entries and orders; IdentificationError::too_short,
/// singular (the data do not tell the parameters apart). Cost: O(samples d²), allocates.
/// Source: Ljung, "System Identification" (2nd ed.), sections 4.2 and 7.3.
[[nodiscard]] Expected<PolynomialFit> fit_arx(const MatrixRef& u, const MatrixRef& y, Time period,
                                              const PolynomialOrders& orders);

/// Which criterion orders are chosen by; less is better.
enum class OrderCriterion { aic, bic, mdl };

/// The ARX model of the best orders within a range, all compared on the same samples; one
/// factorisation serves them all.
/// @param most  The largest a, b and delay; a and the delay from 0, b from 1.
/// @errors As `fit_arx`. Cost: O(samples d² + orders d³).
/// Source: Ljung, section 16.4; Akaike, IEEE Trans. Automatic Control 19 (1974); Rissanen,
/// Automatica 14 (1978).
[[nodiscard]] Expected<PolynomialFit> select_arx(const MatrixRef& u, const MatrixRef& y,
                                                 Time period, const PolynomialOrders& most,
                                                 OrderCriterion criterion = OrderCriterion::bic);

/// The model of any of the family whose prediction errors e have the least sum of squares.
///
/// Starts by linear regressions (a long ARX model for the noise, Steiglitz and McBride's iteration
/// for the output error) and goes on by Levenberg's and Marquardt's method with exact
/// derivatives, each of them one filtering. C and the F_j are kept stable by reflecting their roots
/// into the unit circle, so that the predictor is. Initial states are zero: records should begin at
/// rest, or be long. Where A and F are both looked for, poles of the one may end in the other.
/// @param u, y, period  As `fit_arx`. @param orders  Of every polynomial.
/// @errors As `fit_arx`. Cost: O(samples d²) an iteration, at most 100; allocates.
/// Source: Ljung, sections 4.2, 7.2, 10.2 and 10.5; Steiglitz and McBride, IEEE Trans. Automatic
/// Control 10 (1965); Hannan and Rissanen, Biometrika 69 (1982).
[[nodiscard]] Expected<PolynomialFit> fit_prediction_error(const MatrixRef& u, const MatrixRef& y,
                                                           Time period,
                                                           const PolynomialOrders& orders);

/// The same model in states, with x0 = 0: as many as the polynomials need.
/// @errors ArgumentError::malformed for a leading coefficient that is not 1, wrong_shape, empty.
/// Source: Ljung, section 4.3; observer canonical forms in series and beside each other.
[[nodiscard]] Expected<InnovationsModel> to_state_space(const PolynomialModel& model);

}  // namespace flyball::identification
