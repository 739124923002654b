#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/classical/frequency_data.hpp>
#include <flyball/classical/mimo_margins.hpp>
#include <flyball/classical/nyquist.hpp>
#include <flyball/classical/response_margins.hpp>
#include <flyball/systems/conversion.hpp>
#include <flyball/systems/interconnection.hpp>

#include "classical/transfer_cases.hpp"

// Margins that python-control (0.10, control/tests/margin_test.py) holds itself to, and MATLAB
// where it says so: the numbers of its loops, to the tolerance that it asks of itself.
namespace flyball::classical::peer_margins_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using flyball::test::transfer;

using Pairs = std::vector<std::pair<double, double>>;

/// Where |L| = 1 with the margin in degrees, where L < 0 with the ratio; least |1 + L| and where.
struct Case {
  TransferFunction loop;
  Pairs phase_margins;
  Pairs gain_margins;
  double distance = 0.0;
  double relative = 2e-4;
};

TransferFunction of_roots(std::initializer_list<Complex> zeros,
                          std::initializer_list<Complex> poles, double gain) {
  const auto list = [](std::initializer_list<Complex> v) {
    return VectorXcd(Eigen::Map<const VectorXcd>(v.begin(), static_cast<Index>(v.size())));
  };
  return TransferFunction::from_zeros(list(zeros), list(poles), gain).value();
}

std::vector<Case> cases() {
  std::vector<Case> all;
  all.push_back({transfer({1.0, 2.0}, {1.0, 2.0, 3.0}), {}, {}});
  all.push_back({transfer({1.0}, {1.0, 2.0, 3.0, 4.0}), {}, {{1.7321, 2.0}}, 0.4170});
  const auto servo = series(transfer({8.75 * 4.0, 8.75 * 0.4, 8.75}, {100.0, 23.0, 100.22, 1.0}),
                            transfer({1.0}, {0.01, 0.008, 1.0}))
                         .value();
  all.push_back({servo,
                 {{0.0850, 97.5941}, {0.9373, -157.7844}, {1.0919, 134.7359}},
                 {{10.0053, 2.2716}},
                 0.5591,
                 1e-3});
  all.push_back({transfer({1.0}, {1.0, 1.0}), {}, {}});
  all.push_back({transfer({3.0, 30.0}, {1.0, 2.0}), {}, {}});
  all.push_back({transfer({-0.01, 0.1}, {1.0, 3.0, 2.0}), {}, {{5.6569, 300.0}}, 0.9917});
  all.push_back({transfer({200.0}, {1.0, 21.0, 20.0, 0.0}), {{-1.0, 0.0}}, {{4.47213595, 2.1}}});
  all.push_back({transfer({0.8}, {1.0, 3.0, 3.0, 1.0}), {}, {{1.7321, 10.0}}});
  all.push_back({transfer({2.0}, {1.0, 3.0, 3.0, 1.0}), {{0.7663, 67.6058}}, {{1.7321, 4.0}}});
  all.push_back({transfer({2.0, 0.0}, {1.0, 1.0}), {{0.57735, -120.0}}, {}});
  all.push_back({transfer({1.0, 0.1}, {1.0, 1.0, 0.0}), {{0.3162, 144.9032}}, {}});
  all.push_back({transfer({1.0, 0.1}, {1.0, 1.0, 0.0, 0.0}), {{0.7907, 44.4594}}, {}});
  all.push_back({transfer({1.0, 0.2, 0.01}, {1.0, 1.0, 0.0, 0.0, 0.0}),
                 {{0.7951, 37.1748}},
                 {{0.1119, 0.0626}},
                 0.0,
                 3e-3});
  // Bavafa-Toosi, "A note on the gain and phase margin concepts" (2015): one loop, three gains.
  for (const auto& [K, w, margin] :
       {std::tuple{1.0, 0.0022, -14.5640}, {1000.0, 0.0630, 22.5215}, {5000.0, 0.1868, 21.2101}}) {
    all.push_back({of_roots({-0.02, -0.05, -5.0, -10.0},
                            {0.0005, -0.0001, -0.01, -0.2, -1.0, -100.0, -100.0}, 0.002 * K),
                   {{w, margin}},
                   {{0.0, 0.01 / K},
                    {0.0243, 179.2931 / K},
                    {0.4385, 2.2798e4 / K},
                    {6.8640, 1.5946e7 / K},
                    {84.9323, 7.2477e8 / K}},
                   0.0,
                   2e-3});
  }
  return all;
}

void expect_pairs(const Case& c, const LoopMargins& got, std::size_t number) {
  const bool unknown = c.phase_margins.size() == 1 && c.phase_margins[0].first < 0.0;
  if (!unknown) {
    ASSERT_EQ(got.gain_crossings.size(), c.phase_margins.size()) << number;
    for (std::size_t k = 0; k < c.phase_margins.size(); ++k) {
      const auto& [w, margin] = c.phase_margins[k];
      EXPECT_NEAR(got.gain_crossings[k].frequency, w, 2e-2 * w) << number;
      EXPECT_NEAR(got.gain_crossings[k].phase_margin, margin, 1e-2) << number;
    }
  }
  ASSERT_EQ(got.phase_crossings.size(), c.gain_margins.size()) << number;
  for (std::size_t k = 0; k < c.gain_margins.size(); ++k) {
    const auto& [w, ratio] = c.gain_margins[k];
    EXPECT_NEAR(got.phase_crossings[k].frequency, w, 3e-3 * w) << number;
    EXPECT_NEAR(got.phase_crossings[k].gain_margin / ratio, 1.0, c.relative) << number;
  }
  if (c.distance > 0.0) {
    EXPECT_NEAR(1.0 / got.sensitivity.value, c.distance, 1e-4) << number;
  }
}

TEST(PeerMargins, OfPythonControl) {
  std::size_t number = 0;
  for (const Case& c : cases()) {
    expect_pairs(c, loop_margins(c.loop).value(), number);
    expect_pairs(c, loop_margins(frequency_response(c.loop).value()).value(), number);
    ++number;
  }
  // An unstable plant as states: 147.0743° at 2.5483 rad/s.
  ContinuousSystem<> states;
  states.A.resize(2, 2);
  states.A << 1.0, 4.0, 3.0, 2.0;
  states.B = Eigen::Vector2d(1.0, -4.0);
  states.C = Eigen::RowVector2d(1.0, 0.0);
  states.D = MatrixXd::Zero(1, 1);
  const auto got = loop_margins(frequency_response(states).value()).value();
  ASSERT_EQ(got.gain_crossings.size(), 1U);
  EXPECT_NEAR(got.gain_crossings[0].frequency, 2.5483, 1e-4);
  EXPECT_NEAR(got.gain_crossings[0].phase_margin, 147.0743, 1e-4);
}

// Zero-order hold of continuous loops: gain margin, phase margin, distance, and where each is.
TEST(PeerMargins, OfSampledLoops) {
  struct Sampled {
    TransferFunction plant;
    double period;
    double gain_margin, phase_margin, distance, at_gain, at_phase;
  };
  const double turn = 2.0 * std::numbers::pi;
  for (const Sampled& c :
       {Sampled{transfer({2.0}, {1.0, 3.0, 2.0, 0.0}), 1e-2, 2.955761, 32.398492, 0.429535,
                1.403725, 0.749367},
        {transfer({2.0}, {1.0, 3.0, 3.0, 1.0}), 0.1, 3.4927, 65.4212, 0.5763, 1.6283, 0.76625},
        {transfer({1.1 * turn * turn}, {1.0, 0.4 * turn, turn * turn}), 0.05, 2.3842, 18.161,
         0.26953, 11.712, 8.7478},
        {transfer({5e4}, {1.0, 101.0, 10101.0, 10100.0, 10000.0}), 1e-3, 18.8766, 26.3564, 0.406841,
         9.76358, 2.32933}}) {
    const auto sampled =
        convert_to_discrete(c.plant.to_state_space(), Time(c.period), ConversionMethod::zoh)
            .value();
    const LoopMargins got = loop_margins(frequency_response(sampled).value()).value();
    ASSERT_TRUE(got.gain_margin && got.phase_margin);
    EXPECT_NEAR(*got.gain_margin / c.gain_margin, 1.0, 1e-4);
    EXPECT_NEAR(*got.phase_margin / c.phase_margin, 1.0, 1e-4);
    EXPECT_NEAR(1.0 / got.sensitivity.value / c.distance, 1.0, 1e-4);
    EXPECT_NEAR(got.gain_crossings.back().frequency / c.at_phase, 1.0, 1e-4);
    EXPECT_NEAR(got.phase_crossings.front().frequency / c.at_gain, 1.0, 1e-4);
  }
}

// MATLAB's diskmargin: 25/(s³ + 10 s² + 10 s + 10), and the spinning satellite with a controller,
// at its output and its input: 0.3754 there, a bound; SciPy's minimize_scalar over the scaling of
// two channels gives 2/5.3169985 = 0.376152069, at rest.
TEST(PeerMargins, OfDisks) {
  const double alpha = loop_margins(transfer({25.0}, {1.0, 10.0, 10.0, 10.0})).value().disk_margin;
  EXPECT_NEAR(alpha, 0.46, 5e-3);
  EXPECT_NEAR(20.0 * std::log10((2.0 + alpha) / (2.0 - alpha)), 4.05, 5e-3);
  EXPECT_NEAR(2.0 * std::atan(0.5 * alpha) * 180.0 / std::numbers::pi, 25.8, 0.05);
  ContinuousSystem<> P;
  P.A.resize(2, 2);
  P.A << 0.0, 10.0, -10.0, 0.0;
  P.B = MatrixXd::Identity(2, 2);
  P.C.resize(2, 2);
  P.C << 1.0, 10.0, -10.0, 1.0;
  P.D = MatrixXd::Zero(2, 2);
  ContinuousSystem<> K{MatrixXd(0, 0), MatrixXd(0, 2), MatrixXd(2, 0), MatrixXd(2, 2)};
  K.D << 1.0, -2.0, 0.0, 1.0;
  EXPECT_NEAR(mimo_margins(series(K, P).value()).value().disk_margin, 0.376152069, 1e-8);
  EXPECT_NEAR(mimo_margins(series(P, K).value()).value().disk_margin, 0.376152069, 1e-8);
}

// Thirty-eight measured points behind (1 + 1.9 s)/s². By hand: at 2.02 rad/s the points, 0.25 dB
// and -31.2° there, and 4.08 of the controller's 4.08 make one; 75.4° - 31.2° are left. (A spline
// that smooths the real and imaginary parts gives 44.55°.)
TEST(PeerMargins, OfMeasuredPoints) {
  const std::vector<double> hertz{
      0.005, 0.010, 0.020, 0.030, 0.040, 0.050, 0.060, 0.070, 0.080, 0.090, 0.100, 0.200, 0.300,
      0.400, 0.500, 0.750, 1.000, 1.250, 1.500, 1.750, 2.000, 2.250, 2.500, 2.750, 3.000, 3.250,
      3.500, 3.750, 4.000, 4.250, 4.500, 4.750, 5.000, 6.000, 7.000, 8.000, 9.000, 10.000};
  const std::vector<double> decibels{
      0.0,   0.0,   0.0,   0.0,   0.0,   0.0,   0.0,   0.0,   0.0,   0.0,   0.0,   0.1,   0.2,
      0.3,   0.5,   0.5,   -0.4,  -2.3,  -4.8,  -7.3,  -9.6,  -11.7, -13.6, -15.3, -16.9, -18.3,
      -19.6, -20.8, -22.0, -23.1, -24.1, -25.0, -25.9, -29.1, -31.9, -34.2, -36.2, -38.1};
  const std::vector<double> degrees{0.0,    -1.0,   -2.0,   -3.0,   -4.0,   -5.0,   -6.0,   -7.0,
                                    -8.0,   -9.0,   -10.0,  -19.0,  -29.0,  -40.0,  -51.0,  -81.0,
                                    -114.0, -144.0, -168.0, -187.0, -202.0, -214.0, -224.0, -233.0,
                                    -240.0, -247.0, -253.0, -259.0, -264.0, -269.0, -273.0, -277.0,
                                    -280.0, -292.0, -301.0, -307.0, -313.0, -317.0};
  const TransferFunction C = transfer({1.9, 1.0}, {1.0, 0.0, 0.0});
  VectorXd w(38);
  Eigen::MatrixXcd values(1, 38);
  for (Index k = 0; k < 38; ++k) {
    const auto at = static_cast<std::size_t>(k);
    w(k) = 2.0 * std::numbers::pi * hertz[at];
    values(0, k) =
        std::polar(std::pow(10.0, decibels[at] / 20.0), degrees[at] * std::numbers::pi / 180.0) *
        C.response(w(k));
  }
  const LoopMargins got = loop_margins(FrequencyData::create(w, values).value()).value();
  EXPECT_NEAR(*got.phase_margin, 44.2, 0.15);
  EXPECT_NEAR(got.gain_crossings[0].frequency, 2.02, 0.01);
}

}  // namespace
}  // namespace flyball::classical::peer_margins_test
