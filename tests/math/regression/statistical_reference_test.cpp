#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/math/regression/least_squares.hpp>
#include <flyball/math/regression/streamed_least_squares.hpp>

// Statistical Reference Datasets of the National Institute of Standards and Technology, linear
// regression: certified to 15 digits from computations with 500.
namespace flyball::statistical_reference_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Reference {
  MatrixXd X;
  VectorXd y;
  VectorXd beta;
  VectorXd errors;
  double deviation;  ///< Of the residuals.
  double r_squared;
};

/// Digits that agree; 15 if all of the certified ones do.
double digits(double value, double certified) {
  const double error =
      certified == 0.0 ? std::abs(value) : std::abs(value - certified) / std::abs(certified);
  return std::min(15.0, -std::log10(std::max(error, 1e-16)));
}
double digits(const VectorXd& values, const VectorXd& certified) {
  double least = 15.0;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    least = std::min(least, digits(values(i), certified(i)));
  }
  return least;
}

MatrixXd powers(const VectorXd& x, int degree) {
  MatrixXd X(x.size(), degree + 1);
  for (int j = 0; j <= degree; ++j) {
    X.col(j) = x.array().pow(j);
  }
  return X;
}
VectorXd vector(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

struct Digits {
  double beta;
  double errors;
};

void expect_digits(const Reference& reference, Digits least) {
  const LeastSquares fit = least_squares(reference.X, reference.y).value();
  EXPECT_EQ(fit.rank, reference.X.cols());
  EXPECT_GE(digits(fit.coefficients, reference.beta), least.beta);
  if (reference.deviation == 0.0) {
    EXPECT_LT(std::sqrt(fit.variance), 1e-14 * reference.y.norm());
  } else {
    EXPECT_GE(digits(fit.standard_errors, reference.errors), least.errors);
    EXPECT_GE(digits(std::sqrt(fit.variance), reference.deviation), least.errors);
  }
  EXPECT_NEAR(fit.r_squared, reference.r_squared, fit.condition > 1e7 ? 1e-10 : 1e-14);

  // Row by row, without a correction: the digits that the condition leaves (Golub and Van Loan,
  // section 5.3.7).
  auto stream = StreamedLeastSquares::create(reference.X.cols()).value();
  EXPECT_TRUE(stream.add(reference.X, reference.y));
  const Regression streamed = stream.solve().value();
  const double slope = std::sqrt(1.0 / reference.r_squared - 1.0);
  EXPECT_GE(digits(streamed.coefficients, reference.beta),
            13.0 - std::log10(fit.condition * (1.0 + fit.condition * slope)));
  EXPECT_NEAR(streamed.r_squared, reference.r_squared, 1e-10);
}

Reference norris_like(const std::vector<double>& x, const std::vector<double>& y, double beta,
                      double error, double deviation, double r_squared) {
  return {vector(x), vector(y), VectorXd::Constant(1, beta), VectorXd::Constant(1, error),
          deviation, r_squared};
}

TEST(StatisticalReference, NoIntercept) {
  expect_digits(
      norris_like({60, 61, 62, 63, 64, 65, 66, 67, 68, 69, 70},
                  {130, 131, 132, 133, 134, 135, 136, 137, 138, 139, 140}, 2.07438016528926,
                  0.165289256198347e-01, 3.56753034006338, 0.999365492298663),
      {14.5, 13.5});
  expect_digits(norris_like({4, 5, 6}, {3, 4, 4}, 0.727272727272727, 0.420827318078432e-01,
                            0.369274472937998, 0.993348115299335),
                {14.5, 13.5});
}

TEST(StatisticalReference, Pontius) {
  VectorXd x(40);
  for (int i = 0; i < 20; ++i) {
    x(i) = x(i + 20) = 150000.0 * (i + 1);
  }
  const VectorXd y = vector(
      {.11019,  .21956,  .32949,  .43899,  .54803,  .65694,  .76562,  .87487,  .98292,  1.09146,
       1.20001, 1.30822, 1.41599, 1.52399, 1.63194, 1.73947, 1.84646, 1.95392, 2.06128, 2.16844,
       .11052,  .22018,  .32939,  .43886,  .54798,  .65739,  .76596,  .87474,  .98300,  1.09150,
       1.20004, 1.30818, 1.41613, 1.52408, 1.63159, 1.73965, 1.84696, 1.95445, 2.06177, 2.16829});
  expect_digits({powers(x, 2), y,
                 vector({0.673565789473684e-03, 0.732059160401003e-06, -0.316081871345029e-14}),
                 vector({0.107938612033077e-03, 0.157817399981659e-09, 0.486652849992036e-16}),
                 0.205177424076185e-03, 0.999999900178537},
                {11.9, 12.5});
}

TEST(StatisticalReference, Longley) {
  MatrixXd data(16, 7);
  data << 60323, 83.0, 234289, 2356, 1590, 107608, 1947,  //
      61122, 88.5, 259426, 2325, 1456, 108632, 1948,      //
      60171, 88.2, 258054, 3682, 1616, 109773, 1949,      //
      61187, 89.5, 284599, 3351, 1650, 110929, 1950,      //
      63221, 96.2, 328975, 2099, 3099, 112075, 1951,      //
      63639, 98.1, 346999, 1932, 3594, 113270, 1952,      //
      64989, 99.0, 365385, 1870, 3547, 115094, 1953,      //
      63761, 100.0, 363112, 3578, 3350, 116219, 1954,     //
      66019, 101.2, 397469, 2904, 3048, 117388, 1955,     //
      67857, 104.6, 419180, 2822, 2857, 118734, 1956,     //
      68169, 108.4, 442769, 2936, 2798, 120445, 1957,     //
      66513, 110.8, 444546, 4681, 2637, 121950, 1958,     //
      68655, 112.6, 482704, 3813, 2552, 123366, 1959,     //
      69564, 114.2, 502601, 3931, 2514, 125368, 1960,     //
      69331, 115.7, 518173, 4806, 2572, 127852, 1961,     //
      70551, 116.9, 554894, 4007, 2827, 130081, 1962;
  MatrixXd X(16, 7);
  X << VectorXd::Ones(16), data.rightCols(6);
  expect_digits(
      {X, data.col(0),
       vector({-3482258.63459582, 15.0618722713733, -0.358191792925910e-01, -2.02022980381683,
               -1.03322686717359, -0.511041056535807e-01, 1829.15146461355}),
       vector({890420.383607373, 84.9149257747669, 0.334910077722432e-01, 0.488399681651699,
               0.214274163161675, 0.226073200069370, 455.478499142212}),
       304.854073561965, 0.995479004577296},
      {12.5, 11.5});
}

VectorXd wampler_x() {
  return VectorXd::LinSpaced(21, 0.0, 20.0);
}

TEST(StatisticalReference, Wampler) {
  const MatrixXd X = powers(wampler_x(), 5);
  const VectorXd y1 = X * VectorXd::Ones(6);
  const VectorXd none = VectorXd::Zero(6);
  expect_digits({X, y1, VectorXd::Ones(6), none, 0.0, 1.0}, {14.5, 0.0});
  const VectorXd small = vector({1.0, 0.1, 0.01, 0.001, 0.0001, 0.00001});
  const VectorXd y2 =
      vector({1.00000,  1.11111,  1.24992,  1.42753,  1.65984,  1.96875,  2.38336,
              2.94117,  3.68928,  4.68559,  6.00000,  7.71561,  9.92992,  12.75603,
              16.32384, 20.78125, 26.29536, 33.05367, 41.26528, 51.16209, 63.00000});
  expect_digits({X, y2, small, none, 0.0, 1.0}, {12.5, 0.0});

  // Wampler 3 to 5 add 1, 100 and 10⁴ times the same residuals.
  const VectorXd y3 = vector({760,    -2042,  2111,    -1684,   3888,    1858,    11379,
                              17560,  39287,  64382,   113159,  175108,  273291,  400186,
                              581243, 811568, 1121004, 1506550, 2002767, 2611612, 3369180});
  const VectorXd errors = vector({2152.32624678170, 2363.55173469681, 779.343524331583,
                                  101.475507550350, 5.64566512170752, 0.112324854679312});
  const double r_squared[] = {0.999995559025820, 0.957478440825662, 0.224668921574940e-02};
  for (int k = 0; k < 3; ++k) {
    const double scale = std::pow(100.0, k);
    expect_digits({X, y1 + scale * (y3 - y1), VectorXd::Ones(6), scale * errors,
                   scale * 2360.14502379268, r_squared[k]},
                  {k == 2 ? 13.5 : 14.5, 11.5});
  }
}

TEST(StatisticalReference, Filip) {
  const VectorXd y = vector(
      {0.8116, 0.9072, 0.9052, 0.9039, 0.8053, 0.8377, 0.8667, 0.8809, 0.7975, 0.8162, 0.8515,
       0.8766, 0.8885, 0.8859, 0.8959, 0.8913, 0.8959, 0.8971, 0.9021, 0.909,  0.9139, 0.9199,
       0.8692, 0.8872, 0.89,   0.891,  0.8977, 0.9035, 0.9078, 0.7675, 0.7705, 0.7713, 0.7736,
       0.7775, 0.7841, 0.7971, 0.8329, 0.8641, 0.8804, 0.7668, 0.7633, 0.7678, 0.7697, 0.77,
       0.7749, 0.7796, 0.7897, 0.8131, 0.8498, 0.8741, 0.8061, 0.846,  0.8751, 0.8856, 0.8919,
       0.8934, 0.894,  0.8957, 0.9047, 0.9129, 0.9209, 0.9219, 0.7739, 0.7681, 0.7665, 0.7703,
       0.7702, 0.7761, 0.7809, 0.7961, 0.8253, 0.8602, 0.8809, 0.8301, 0.8664, 0.8834, 0.8898,
       0.8964, 0.8963, 0.9074, 0.9119, 0.9228});
  const VectorXd x =
      vector({-6.860120914, -4.324130045, -4.358625055, -4.358426747, -6.955852379, -6.661145254,
              -6.355462942, -6.118102026, -7.115148017, -6.815308569, -6.519993057, -6.204119983,
              -5.853871964, -6.109523091, -5.79832982,  -5.482672118, -5.171791386, -4.851705903,
              -4.517126416, -4.143573228, -3.709075441, -3.499489089, -6.300769497, -5.953504836,
              -5.642065153, -5.031376979, -4.680685696, -4.329846955, -3.928486195, -8.56735134,
              -8.363211311, -8.107682739, -7.823908741, -7.522878745, -7.218819279, -6.920818754,
              -6.628932138, -6.323946875, -5.991399828, -8.781464495, -8.663140179, -8.473531488,
              -8.247337057, -7.971428747, -7.676129393, -7.352812702, -7.072065318, -6.774174009,
              -6.478861916, -6.159517513, -6.835647144, -6.53165267,  -6.224098421, -5.910094889,
              -5.598599459, -5.290645224, -4.974284616, -4.64454848,  -4.290560426, -3.885055584,
              -3.408378962, -3.13200249,  -8.726767166, -8.66695597,  -8.511026475, -8.165388579,
              -7.886056648, -7.588043762, -7.283412422, -6.995678626, -6.691862621, -6.392544977,
              -6.067374056, -6.684029655, -6.378719832, -6.065855188, -5.752272167, -5.132414673,
              -4.811352704, -4.098269308, -3.66174277,  -3.2644011});
  // The powers of x are not doubles; their rounding is worth half of the digits.
  expect_digits({powers(x, 10), y,
                 vector({-1467.48961422980, -2772.17959193342, -2316.37108160893, -1127.97394098372,
                         -354.478233703349, -75.1242017393757, -10.8753180355343, -1.06221498588947,
                         -0.670191154593408e-01, -0.246781078275479e-02, -0.402962525080404e-04}),
                 vector({298.084530995537, 559.779865474950, 466.477572127796, 227.204274477751,
                         71.6478660875927, 15.2897178747400, 2.23691159816033, 0.221624321934227,
                         0.142363763154724e-01, 0.535617408889821e-03, 0.896632837373868e-05}),
                 0.334801051324544e-02, 0.996727416185620},
                {7.0, 7.0});
}

}  // namespace
}  // namespace flyball::statistical_reference_test
