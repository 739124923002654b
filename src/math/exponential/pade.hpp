#pragma once

#include <array>
#include <cstddef>

namespace flyball::detail {

/// A Padé approximant of exp of order m: the numerator's coefficients, divided by the first so that
/// rows and columns of zeros leave those of the identity to the last bit, the norm up to which it
/// is exact to rounding (Higham 2005; Al-Mohy and Higham 2009, Table 3.1), and log₂ of the inverse
/// of the backward error's first coefficient, binomial(2m, m) (2m + 1)!.
struct Pade {
  int order;
  double theta;
  double log2_inverse_error;
  double b[14];

  constexpr Pade(int m, double reach, double log2_error, std::array<double, 14> coefficients)
      : order(m), theta(reach), log2_inverse_error(log2_error), b{} {
    for (std::size_t k = 0; k < coefficients.size(); ++k) {
      b[k] = coefficients[k] / coefficients[0];
    }
  }
};
inline constexpr Pade pade[5] = {
    {3, 1.495585217958292e-2, 16.62113611327464, {120.0, 60.0, 12.0, 1.0}},
    {5, 2.539398330063230e-1, 33.227772656854164, {30240.0, 15120.0, 3360.0, 420.0, 30.0, 1.0}},
    {7,
     9.504178996162932e-1,
     51.994974307382165,
     {17297280.0, 8648640.0, 1995840.0, 277200.0, 25200.0, 1512.0, 56.0, 1.0}},
    {9,
     2.097847961257068,
     72.32471809893495,
     {17643225600.0, 8821612800.0, 2075673600.0, 302702400.0, 30270240.0, 2162160.0, 110880.0,
      3960.0, 90.0, 1.0}},
    {13,
     4.25,
     116.447004251763,
     {64764752532480000.0, 32382376266240000.0, 7771770303897600.0, 1187353796428800.0,
      129060195264000.0, 10559470521600.0, 670442572800.0, 33522128640.0, 1323241920.0, 40840800.0,
      960960.0, 16380.0, 182.0, 1.0}}};

}  // namespace flyball::detail
