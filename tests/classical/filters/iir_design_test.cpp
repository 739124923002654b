#include <flyball/classical/filters/iir_design.hpp>

#include <limits>
#include <numbers>

#include <flyball/core/random.hpp>

#include "classical/filters/elliptic_functions.hpp"
#include "classical/filters/filter_cases.hpp"

namespace flyball::classical::iir_design_test {
namespace {

using namespace flyball::literals;
using std::numbers::pi;
using test::Complex;
using test::expect_roots;
using test::with_conjugates;

// H(s) = 1/(s² + √2 s + 1), and of order one 1/(s + 1).
TEST(IirDesign, ButterworthInClosedForm) {
  const auto first = filter_prototype(FilterFamily::butterworth, 1).value();
  expect_roots(first.poles, {-1.0}, 0.0);
  EXPECT_EQ(first.gain, 1.0);
  const auto second = filter_prototype(FilterFamily::butterworth, 2).value();
  const double half = std::sqrt(0.5);
  expect_roots(second.poles, with_conjugates({{-half, half}}), 2e-16);
  EXPECT_NEAR(second.gain, 1.0, 4e-16);
}

// Bilinear of 1/(s/ω + 1) with ω = tan(ω_c T/2): (1 + z⁻¹) ω/(1 + ω) / (1 - (1 - ω)/(1 + ω) z⁻¹).
TEST(IirDesign, OneDigitalPoleInClosedForm) {
  const auto filter = design_filter({.order = 1, .frequency = 20.0}, 10_ms).value();
  const double w = std::tan(0.1);
  ASSERT_EQ(filter.sections.size(), 1U);
  EXPECT_NEAR(filter.sections[0].b0, w / (1.0 + w), 1e-16);
  EXPECT_NEAR(filter.sections[0].b1, w / (1.0 + w), 1e-16);
  EXPECT_EQ(filter.sections[0].b2, 0.0);
  EXPECT_NEAR(filter.sections[0].a1, -(1.0 - w) / (1.0 + w), 1e-16);
  EXPECT_EQ(filter.sections[0].a2, 0.0);
}

// SciPy 1.10.1: iirfilter(4, 20 T/π, btype='lowpass', ftype='butter', output='zpk') with T = 0.01,
// and the like.
TEST(IirDesign, AgreesWithSciPy) {
  const auto butter = design_filter({.order = 4, .frequency = 20.0}, 10_ms).value();
  expect_roots(butter.poles,
               with_conjugates({{0.9108192987500925, 0.17057792207089023},
                                {0.8280760868075734, 0.06423698569189437}}),
               1e-15);
  expect_roots(butter.zeros, {-1.0, -1.0, -1.0, -1.0}, 0.0);
  EXPECT_NEAR(butter.gain, 7.8000079742291e-05, 1e-18);

  const auto chebyshev1 = design_filter({.family = FilterFamily::chebyshev1,
                                         .band = FilterBand::band_pass,
                                         .order = 5,
                                         .frequency = 20.0,
                                         .upper_frequency = 50.0,
                                         .ripple = 0.5},
                                        10_ms)
                              .value();
  expect_roots(chebyshev1.poles,
               with_conjugates({{0.9709460871891573, 0.1954765802815987},
                                {0.9424342358819549, 0.22436364938516024},
                                {0.9007179982827707, 0.29133207610405326},
                                {0.8562211708697735, 0.4701692390208635},
                                {0.8622683598099714, 0.387649455339127}}),
               2e-15);
  EXPECT_NEAR(chebyshev1.gain, 1.150452444181435e-05, 1e-19);

  const auto chebyshev2 = design_filter({.family = FilterFamily::chebyshev2,
                                         .band = FilterBand::band_stop,
                                         .order = 6,
                                         .frequency = 20.0,
                                         .upper_frequency = 50.0,
                                         .attenuation = 60.0},
                                        10_ms)
                              .value();
  expect_roots(chebyshev2.zeros,
               with_conjugates({{0.9794699068804944, 0.20159043011888128},
                                {0.9741722607799166, 0.225806125530169},
                                {0.9608752412879775, 0.27698153490760175},
                                {0.9363031497400973, 0.3511928413091206},
                                {0.9044533831710779, 0.4265724764566874},
                                {0.8809623352243445, 0.4731863944748088}}),
               2e-15);
  expect_roots(chebyshev2.poles,
               with_conjugates({{0.9692246678425591, 0.13661805524756138},
                                {0.9201833910481707, 0.13396396596653687},
                                {0.8383017448101248, 0.1338525447387121},
                                {0.7012920419274, 0.5757208645939909},
                                {0.6497505236637336, 0.4075847858818348},
                                {0.6902499827772568, 0.22633276320393686}}),
               5e-15);
  EXPECT_NEAR(chebyshev2.gain, 0.3906104254080889, 2e-15);

  const auto elliptic = design_filter({.family = FilterFamily::elliptic,
                                       .band = FilterBand::high_pass,
                                       .order = 7,
                                       .frequency = 20.0,
                                       .ripple = 0.5,
                                       .attenuation = 60.0},
                                      10_ms)
                            .value();
  expect_roots(elliptic.zeros,
               with_conjugates({{0.9961735057475672, 0.08739763410185367},
                                {0.990107853648296, 0.14030836804682986},
                                {0.9869338789939904, 0.1611257846959179},
                                {1.0, 0.0}}),
               2e-15);
  expect_roots(elliptic.poles,
               with_conjugates({{0.5429979940154152, 0.0},
                                {0.8427635026127178, 0.2543560029070591},
                                {0.9478113581319159, 0.2129658346069153},
                                {0.974333334889476, 0.19631762605357464}}),
               5e-15);
  EXPECT_NEAR(elliptic.gain, 0.6389858912839732, 2e-15);
}

// mpmath 1.3.0 with 150 digits: zeros 1/(k sn(jK/n)) and poles by ellipfun, the nome by ellipk and
// jtheta. Ripples from a nano-decibel on, and attenuations to 500 dB, lose no digit.
TEST(IirDesign, EllipticAtTheExtremes) {
  struct Case {
    int order;
    double ripple, attenuation, stop;
    Complex first, last;
    double largest_zero;
  };
  constexpr Case cases[] = {{5,
                             1.0,
                             40.0,
                             1.2186815414610158583,
                             {-0.38534434027560871832, 0.0},
                             {-0.049920708887160304181, 0.99819805057814576808},
                             1.7642884409085889148},
                            {20,
                             1e-6,
                             250.0,
                             1.8082781865322499205,
                             {-0.47461010631719124928, 0.09818754162858236512},
                             {-0.026615370882937546413, 1.0689458876740455899},
                             21.093214220610531338},
                            {20,
                             3.0,
                             100.0,
                             1.0038159566528043484,
                             {-0.10423143338374007346, 0.1914353286989261426},
                             {-0.00015922536249678657988, 0.99990608273882193752},
                             5.3025069296376233857},
                            {3,
                             1e-9,
                             1.0,
                             12.816882810779914966,
                             {-78.143620215326832309, 0.0},
                             {-1.3472980003567879805, 14.474144075765799356},
                             14.794019977437572899},
                            {8,
                             0.01,
                             500.0,
                             579.4661807280113554,
                             {-0.47404207016229334959, 0.21668288124683366151},
                             {-0.094292575226055798471, 1.0893369566720753356},
                             2970.2435247840918637}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.order);
    const auto filter =
        filter_prototype(FilterFamily::elliptic, c.order, c.ripple, c.attenuation).value();
    const auto nearest = [&](Complex wanted) {
      double error = HUGE_VAL;
      for (const Complex pole : filter.poles) {
        error = std::min({error, std::abs(pole.real() / wanted.real() - 1.0) +
                                     std::abs(pole.imag() - wanted.imag()) / std::abs(wanted)});
      }
      return error;
    };
    EXPECT_LT(nearest(c.first), 2e-14);
    EXPECT_LT(nearest(c.last), 2e-14);
    EXPECT_NEAR(filter.zeros.imag().maxCoeff() / c.largest_zero, 1.0, 2e-14);
    // The loss is the ripple at the one edge and the attenuation at the other.
    EXPECT_NEAR(test::loss(filter.response(1.0)) / c.ripple, 1.0,
                1e-12 + 4e-15 / c.ripple * c.order);
    EXPECT_NEAR(test::loss(filter.response(c.stop)) / c.attenuation, 1.0, 1e-12);
  }
}

// mpmath: polyroots of the reverse Bessel polynomial with 400 more digits, over θ(0)^(1/n).
TEST(IirDesign, BesselToOrderTwenty) {
  const auto fifth = filter_prototype(FilterFamily::bessel, 5).value();
  EXPECT_NEAR(fifth.poles.real().minCoeff(), -0.926442077387760225, 1e-15);
  const auto twentieth = filter_prototype(FilterFamily::bessel, 20).value();
  EXPECT_NEAR(twentieth.poles.real().maxCoeff(), -0.27192995802516526, 1e-15);
  EXPECT_NEAR(twentieth.poles.imag().maxCoeff(), 1.18709937981088589, 1e-15);
  EXPECT_NEAR(twentieth.poles.real().minCoeff(), -0.906257011557677115, 1e-14);
  // Its group delay is flat: as at rest up to half of the edge.
  EXPECT_NEAR(twentieth.group_delay(0.5) / twentieth.group_delay(0.0), 1.0, 1e-12);
  EXPECT_NEAR(fifth.group_delay(0.2) / fifth.group_delay(0.0), 1.0, 1e-6);
}

// At random specifications the designed filter loses at most the ripple where it shall pass and at
// least the attenuation where it shall not, its poles lie inside the circle, and one order less
// would not do.
TEST(IirDesign, MeetsRandomSpecifications) {
  Random random(14);
  int tried = 0;
  int smaller = 0;
  for (int i = 0; i < 2000; ++i) {
    const double T = random.uniform(1e-4, 0.1);
    const auto band = test::bands[random.bits() % 4];
    const auto family = test::with_stop_band[random.bits() % 4];
    std::array<double, 4> edges{};
    for (double& edge : edges) {
      edge = random.uniform(0.001, 0.999) * pi / T;
    }
    std::ranges::sort(edges);
    const FilterSpecification wanted{
        .pass = band == FilterBand::low_pass    ? std::array{edges[1], 0.0}
                : band == FilterBand::high_pass ? std::array{edges[2], 0.0}
                : band == FilterBand::band_pass ? std::array{edges[1], edges[2]}
                                                : std::array{edges[0], edges[3]},
        .stop = band == FilterBand::low_pass    ? std::array{edges[2], 0.0}
                : band == FilterBand::high_pass ? std::array{edges[1], 0.0}
                : band == FilterBand::band_pass ? std::array{edges[0], edges[3]}
                                                : std::array{edges[1], edges[2]},
        .ripple = std::pow(10.0, random.uniform(-3.0, 0.5)),
        .attenuation = random.uniform(5.0, 100.0)};
    const auto order = filter_order(family, band, wanted, Time(T));
    if (!order) {
      EXPECT_TRUE(order.error().is(ArgumentError::out_of_range));
      continue;
    }
    ++tried;
    SCOPED_TRACE(std::string(to_string(family)) + " " + std::string(to_string(band)) + " " +
                 std::to_string(i));
    const auto filter = design_filter(order->design, Time(T)).value();
    EXPECT_LT(filter.poles.cwiseAbs().maxCoeff(), 1.0);
    EXPECT_EQ(filter.sections.size(), static_cast<std::size_t>((filter.poles.size() + 1) / 2));
    const auto passes = [&](double w) {
      switch (band) {
        case FilterBand::low_pass:
          return w <= wanted.pass[0];
        case FilterBand::high_pass:
          return w >= wanted.pass[0];
        case FilterBand::band_pass:
          return w >= wanted.pass[0] && w <= wanted.pass[1];
        default:
          return w <= wanted.pass[0] || w >= wanted.pass[1];
      }
    };
    const auto stops = [&](double w) {
      switch (band) {
        case FilterBand::low_pass:
          return w >= wanted.stop[0];
        case FilterBand::high_pass:
          return w <= wanted.stop[0];
        case FilterBand::band_pass:
          return w <= wanted.stop[0] || w >= wanted.stop[1];
        default:
          return w >= wanted.stop[0] && w <= wanted.stop[1];
      }
    };
    std::vector<double> grid(edges.begin(), edges.end());
    for (int k = 0; k <= 300; ++k) {
      grid.push_back(k / 300.0 * pi / T);
    }
    for (const double w : grid) {
      const double got = test::loss(filter.response(w));
      if (passes(w)) {
        EXPECT_LT(got, wanted.ripple + 1e-7) << w * T;
        EXPECT_GT(got, -1e-7) << w * T;
      } else if (stops(w)) {
        EXPECT_GT(got, wanted.attenuation - 1e-7) << w * T;
      }
    }
    // With the edges at the pass band, one order less does not lose enough at a stop edge.
    const bool from_pass = family == FilterFamily::chebyshev1 || family == FilterFamily::elliptic;
    if (from_pass && order->design.order > 1) {
      IirDesign less = order->design;
      --less.order;
      const auto missed = design_filter(less, Time(T)).value();
      const double upper = wanted.stop[1] > 0.0 ? wanted.stop[1] : wanted.stop[0];
      EXPECT_LT(
          std::min(test::loss(missed.response(wanted.stop[0])), test::loss(missed.response(upper))),
          wanted.attenuation);
      ++smaller;
    }
  }
  EXPECT_GT(tried, 1000);
  EXPECT_GT(smaller, 400);
}

// SciPy 1.10.1: buttord(20 T/π, 35 T/π, 0.5, 50) and the like, T = 0.01. A band stop's edges are
// SciPy's to the tolerance of its minimiser.
TEST(IirDesign, OrdersOfSciPy) {
  const double T = 0.01;
  struct Case {
    FilterFamily family;
    int order;
    double low, high, pass_low, pass_high, stop_low, stop_high, analog;
  };
  constexpr Case cases[] = {
      {FilterFamily::butterworth, 13, 21.672744382759134, 32.3288437455288, 19.39760387446496,
       41.21580846682371, 15.993214125682151, 49.70875410725527, 21.685401913390457},
      {FilterFamily::chebyshev1, 7, 20.0, 35.0, 20.0, 40.0, 15.261557602950607, 51.99935845412268,
       20.0},
      {FilterFamily::chebyshev2, 7, 32.447284013819456, 21.59286143495857, 16.315653562204908,
       48.76293757602436, 19.12024061635636, 41.79998780340473, 32.62580193441645},
      {FilterFamily::elliptic, 5, 20.0, 35.0, 20.0, 40.0, 15.261563488712254, 51.99935845412268,
       20.0}};
  for (const Case& c : cases) {
    SCOPED_TRACE(to_string(c.family));
    const auto order = [&](FilterBand band, std::array<double, 2> pass, std::array<double, 2> stop,
                           std::optional<Time> period = 10_ms) {
      return filter_order(c.family, band,
                          {.pass = pass, .stop = stop, .ripple = 0.5, .attenuation = 50.0}, period)
          .value()
          .design;
    };
    const IirDesign low = order(FilterBand::low_pass, {20.0, 0.0}, {35.0, 0.0});
    EXPECT_EQ(low.order, c.order);
    EXPECT_NEAR(low.frequency, c.low, 1e-12);
    EXPECT_NEAR(order(FilterBand::high_pass, {35.0, 0.0}, {20.0, 0.0}).frequency, c.high, 1e-12);
    const IirDesign pass = order(FilterBand::band_pass, {20.0, 40.0}, {15.0, 52.0});
    EXPECT_NEAR(pass.frequency, c.pass_low, 1e-12);
    EXPECT_NEAR(pass.upper_frequency, c.pass_high, 1e-12);
    const IirDesign stop = order(FilterBand::band_stop, {15.0, 52.0}, {20.0, 40.0});
    EXPECT_NEAR(stop.frequency, c.stop_low, 1e-3);
    EXPECT_NEAR(stop.upper_frequency, c.stop_high, 1e-3);
    EXPECT_NEAR(order(FilterBand::low_pass, {20.0, 0.0}, {35.0, 0.0}, std::nullopt).frequency,
                c.analog, 1e-12);
  }
  EXPECT_EQ(T, (10_ms).si());
}

// Sections are the roots' polynomial: their response is the roots', and the group delay is the
// phase's slope.
TEST(IirDesign, SectionsAndDelayAgreeWithTheRoots) {
  Random random(15);
  for (int i = 0; i < 500; ++i) {
    const double T = random.uniform(1e-3, 1.0);
    const double low = random.uniform(0.05, 0.6) * pi / T;
    const IirDesign design{.family = static_cast<FilterFamily>(random.bits() % 5),
                           .band = test::bands[random.bits() % 4],
                           .order = 1 + static_cast<int>(random.bits() % 10),
                           .frequency = low,
                           .upper_frequency = low * random.uniform(1.2, 1.6),
                           .ripple = random.uniform(0.01, 3.0),
                           .attenuation = random.uniform(20.0, 90.0)};
    const auto filter = design_filter(design, Time(T)).value();
    for (int k = 0; k < 20; ++k) {
      const double w = random.uniform(0.01, 0.99) * pi / T;
      const Complex H = filter.response(w);
      EXPECT_NEAR(std::abs(section_response(filter.sections, w * T) - H), 0.0, 1e-9)
          << to_string(design.family) << to_string(design.band) << design.order;
      if (std::abs(H) > 0.1) {
        const double step = 1e-6 / T;
        const double turn = std::arg(filter.response(w - step) / filter.response(w + step));
        EXPECT_NEAR(filter.group_delay(w), turn / (2.0 * step),
                    1e-3 * (T + std::abs(filter.group_delay(w))));
      }
    }
  }
}

// Far below the sample rate a constant still passes unchanged: the gain is of the coefficients as
// they are rounded.
TEST(IirDesign, KeepsTheReferenceGainAtLowEdges) {
  for (const double edge : {1e-2, 1e-4, 1e-6}) {
    const auto filter = design_filter({.order = 4, .frequency = edge}, Time(1.0)).value();
    for (const Biquad& c : filter.sections) {
      EXPECT_NEAR(((c.b0 + c.b1) + c.b2) / ((1.0 + c.a1) + c.a2), 1.0, 1e-15);
      EXPECT_LT(std::abs(c.a2), 1.0);
    }
  }
}

// dn² + k² sn² = 1, cn² + sn² = 1, and F undoes sn; K(1/√2) = Γ(¼)²/(4√π).
TEST(EllipticFunctions, KeepTheirIdentities) {
  using namespace detail;
  EXPECT_NEAR(complete_integral({std::sqrt(0.5), std::sqrt(0.5)}), 1.8540746773013719184, 4e-16);
  Random random(16);
  for (int i = 0; i < 2000; ++i) {
    const Modulus m = modulus_of(-std::pow(10.0, random.uniform(-1.2, 2.5)));
    EXPECT_NEAR(m.k * m.k + m.complement * m.complement, 1.0, 3e-14);
    const double fraction = random.uniform(0.0, 1.0);
    const auto [sn, cn, dn] = jacobi(fraction, 1.0 - fraction, m);
    EXPECT_NEAR(sn * sn + cn * cn, 1.0, 3e-14);
    EXPECT_NEAR(dn * dn + m.k * m.k * sn * sn, 1.0, 3e-14);
    EXPECT_NEAR(incomplete_integral(sn, cn, m) / complete_integral(m), fraction, 1e-13);
  }
}

TEST(IirDesign, Refuses) {
  const auto refused = [](const IirDesign& design, Time period = 10_ms) {
    const auto filter = design_filter(design, period);
    EXPECT_FALSE(filter);
    return filter ? std::string() : to_string(filter.error());
  };
  EXPECT_EQ(refused({.order = 0, .frequency = 1.0}),
            "design_filter: order is 0; it must be 1 to 20");
  EXPECT_EQ(
      refused({.frequency = 400.0}),
      "design_filter: frequency is 400 rad/s; it must be below half the sample rate, which is "
      "314.159 rad/s");
  EXPECT_EQ(refused({.band = FilterBand::band_pass, .frequency = 20.0, .upper_frequency = 10.0}),
            "design_filter: upper_frequency is 10 rad/s; it must be above frequency, which is 20 "
            "rad/s");
  EXPECT_EQ(
      refused(
          {.family = FilterFamily::elliptic, .frequency = 1.0, .ripple = 3.0, .attenuation = 2.0}),
      "design_filter: attenuation is 2 dB; it must be above the ripple, which is 3 dB");
  EXPECT_EQ(
      refused({.order = 8, .frequency = 1e-9}, Time(1.0)),
      "design_filter: frequency is 1e-09 rad/s, 1e-09 rad a sample; it must be not so far from "
      "the sample rate that rounded coefficients are unstable; take a lower order, or fewer "
      "samples (decimate)");
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(design_filter({.frequency = nan}, 10_ms).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(design_filter({.frequency = -1.0}, 10_ms).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(design_filter({.frequency = 1.0}, Time(0.0)).error().is(ArgumentError::not_positive));
  EXPECT_EQ(
      to_string(design_analog_filter({.band = FilterBand::band_stop, .frequency = 1.0}).error()),
      "design_analog_filter: upper_frequency is missing; it must be above frequency, which is 1 "
      "rad/s");
  EXPECT_TRUE(design_analog_filter({.order = 20, .frequency = 1e20})
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(design_analog_filter({.order = 20, .frequency = 1e-20})
                  .error()
                  .is(ArgumentError::out_of_range));
  const auto order = [](FilterFamily family, std::array<double, 2> pass,
                        std::array<double, 2> stop) {
    return filter_order(family, FilterBand::low_pass,
                        {.pass = pass, .stop = stop, .ripple = 1.0, .attenuation = 60.0}, 10_ms)
        .error();
  };
  EXPECT_TRUE(order(FilterFamily::butterworth, {20.0}, {10.0}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(order(FilterFamily::butterworth, {20.0}, {20.1}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(order(FilterFamily::butterworth, {20.0}, {500.0}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(order(FilterFamily::bessel, {20.0}, {50.0}).is(ArgumentError::malformed));
  EXPECT_TRUE(
      make_filter(Eigen::VectorXcd(), Eigen::VectorXcd::Constant(1, Complex(0.5, 0.1)), 1.0, 1_s)
          .error()
          .is(ArgumentError::malformed));
  EXPECT_TRUE(make_filter(Eigen::VectorXcd(), Eigen::VectorXcd::Constant(1, 1.0), 1.0, 1_s)
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(make_filter(Eigen::VectorXcd::Zero(2), Eigen::VectorXcd::Zero(1), 1.0, 1_s)
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(make_filter(Eigen::VectorXcd::Constant(1, 1.0), Eigen::VectorXcd::Zero(1), 1.0, 1_s)
                  .error()
                  .is(ArgumentError::malformed));
}

}  // namespace
}  // namespace flyball::classical::iir_design_test
