#pragma once

#include <complex>
#include <optional>
#include <vector>

#include "math/extended/double_double.hpp"

/// Real polynomials in descending powers, in 31 digits: column vectors of coefficients.
namespace flyball::classical::detail {

using Polynomial = flyball::detail::DoubleDoubleMatrix;

[[nodiscard]] Polynomial polynomial(const Eigen::VectorXd& coefficients);
[[nodiscard]] Polynomial times(const Polynomial& a, const Polynomial& b);
/// a + sign·b, of any two degrees.
[[nodiscard]] Polynomial plus(const Polynomial& a, double sign, const Polynomial& b);
/// Without the zeros in front; one coefficient at least.
[[nodiscard]] Polynomial trimmed(const Polynomial& p);
[[nodiscard]] Polynomial derivative(const Polynomial& p);
[[nodiscard]] std::complex<double> value(const Eigen::VectorXd& p, std::complex<double> at);

/// All roots, in pairs of exact conjugates: eigenvalues of the balanced companion matrix.
/// Nothing where the iteration does not end. Zeros at the end are roots at zero.
[[nodiscard]] std::optional<Eigen::VectorXcd> roots(const Polynomial& p);

/// Moves roots onto the border of stability, the imaginary axis or (discrete) the unit circle, that
/// are beside it only because of the coefficients' rounding: where the polynomial's value is
/// rounding of its terms. An integrator among other poles stays one when they are multiplied out.
void settle_on_border(Eigen::VectorXcd& roots, const Polynomial& p, bool discrete);

/// The power of two nearest to the geometric mean of a polynomial's roots that are not zero.
[[nodiscard]] int unit_of(const Eigen::VectorXd& p);
/// p(2^unit s) as a polynomial in s.
void change_unit(Polynomial& p, int unit);

/// p(jω) = even(x) + jω odd(x) with x = ω².
struct OnTheAxis {
  Polynomial even;
  Polynomial odd;
};
[[nodiscard]] OnTheAxis on_the_axis(const Polynomial& p);

/// (1 - w)ⁿ p((1 + w)/(1 - w)): a polynomial in z as one in w = (z - 1)/(z + 1), of degree n.
[[nodiscard]] Polynomial bilinear(const Polynomial& p, Eigen::Index degree);

/// The positive x at which a real polynomial may be zero, touching included, by size: where roots
/// are real but for what the coefficients leave open.
[[nodiscard]] std::optional<std::vector<double>> positive_roots(const Polynomial& p);

}  // namespace flyball::classical::detail
