#include <cmath>
#include <limits>

#include "solve/answers.hpp"

// Numbers that python-control's tests hold (margin_test, timeresp_test, sysnorm_test,
// statefbk_test, modelsimp_test, nyquist_test, bdalg_test; most of them made with MATLAB), to the
// digits that they have. Where those come from samples of a response, the exact ones stand here.
namespace flyball::solve::peer_numbers_test {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

void expect_list(const Json& values, const std::vector<double>& wanted, double tolerance,
                 const char* what) {
  ASSERT_EQ(values.size(), wanted.size()) << what;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const Json& value = values[i].is_array() ? values[i][0] : values[i];
    EXPECT_NEAR(value.get<double>(), wanted[i], tolerance) << what << ' ' << i;
  }
}

constexpr const char* second_order = R"({"A": [[1, -2], [3, -4]], "B": [[5], [7]], "C": [[6, 8]],
    "T": 0.1111111111111111, "samples": 10)";

TEST(PeerNumbers, Responses) {
  expect_list(answer("step-response", std::string(second_order) + R"(, "D": [[9]]})").at("y"),
              {9., 17.6457, 24.7072, 30.4855, 35.2234, 39.1165, 42.3227, 44.9694, 47.1599, 48.9776},
              6e-5, "step");
  expect_list(
      answer("initial-response", std::string(second_order) + R"(, "D": [[9]], "x0": [0.5, 1]})")
          .at("y"),
      {11., 8.1494, 5.9361, 4.2258, 2.9118, 1.9092, 1.1508, 0.5833, 0.1645, -0.1391}, 6e-5,
      "initial");
  expect_list(
      answer("impulse-response", std::string(second_order) + "}").at("y"),
      {86., 70.1808, 57.3753, 46.9975, 38.5766, 31.7344, 26.1668, 21.6292, 17.9245, 14.8945}, 6e-5,
      "impulse");
  expect_list(
      answer("step", R"({"num": [1], "den": [1, 1, 0.25], "dt": 0.2, "duration": 2.4})").at("y"),
      {0., 0., 1., 0., 0.75, 0.25, 0.5625, 0.375, 0.4844, 0.4219, 0.457, 0.4375, 0.4482}, 6e-5,
      "sampled step");
  // 9 periods that do not add up to the duration by rounding.
  expect_list(answer("step", R"({"num": [-0.10966442, 0.12431949],
      "den": [1, -1.86789511, 0.88255018], "dt": 0.12493963338370018,
      "duration": 1.1244567004533016})")
                  .at("y"),
              {0., -0.1097, -0.1902, -0.2438, -0.2729, -0.2799, -0.2674, -0.2377, -0.1934, -0.1368},
              6e-5, "odd period");
}

struct StepCase {
  const char* problem;
  /// rise, settling, overshoot, undershoot, peak, peak time, final value.
  double wanted[7];
};

// Exact: by bisection on the closed forms, mpmath of 30 digits. The peer's, of samples: 1.242,
// 9.110, 20.84, 28.0, 1.208, 4.282; 3.8456, 27.9762, 7.4915, 0, 2.6873, 8.0530; and so on.
TEST(PeerNumbers, StepInformation) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (const StepCase& c :
       {StepCase{R"({"num": [-1, 1], "den": [1, 1, 1]})",
                 {1.26611254054, 8.99300967538, 20.8713430477, 28.01871143, 1.20871343048,
                  4.23219851655, 1.0}},
        {R"({"num": [1, -1], "den": [1, 1, 1]})",
         {1.26611254054, 8.99300967538, 20.8713430477, 28.01871143, -1.20871343048, 4.23219851655,
          -1.0}},
        {R"({"num": [-1, 1], "den": [1, 1]})",
         {std::log(9.0), std::log(100.0), 0.0, 100.0, 1.0, none, 1.0}},
        {R"({"num": [1, 5, 5], "den": [1, 1.65, 5, 6.5, 2]})",
         {3.84341680128, 27.9800855418, 7.51298917019, 0.0, 2.68782472925, 8.0839238012, 2.5}},
        {R"({"num": [1], "den": [1, 1, 0]})", {none, none, none, none, none, none, infinity}},
        {R"({"num": [1.881e6], "den": [188.1, 1.881e6]})",
         {std::log(9.0) * 1e-4, std::log(50.0) * 1e-4, 0.0, 0.0, 1.0, none, 1.0}}}) {
    const Json metrics = answer("step", c.problem).at("metrics");
    const char* names[] = {"rise_time", "settling_time", "overshoot",  "undershoot",
                           "peak",      "peak_time",     "final_value"};
    for (std::size_t i = 0; i < 7; ++i) {
      const Json& value = metrics.at(names[i]);
      if (std::isnan(c.wanted[i])) {
        EXPECT_TRUE(value.is_null()) << c.problem << names[i] << value;
      } else if (std::isinf(c.wanted[i])) {
        EXPECT_EQ(value, "inf") << c.problem << names[i];
      } else {
        EXPECT_NEAR(value.get<double>(), c.wanted[i], 1e-9 * std::max(1.0, std::abs(c.wanted[i])))
            << c.problem << names[i];
      }
    }
  }
}

// s/(s² + s + 1) ends at zero: y = e^{-t/2} sin(√3/2 t)/(√3/2), whose top is at tan(√3/2 t) = √3.
TEST(PeerNumbers, PeakOfWhatEndsAtZero) {
  const double t = 2.0 / std::sqrt(3.0) * std::atan(std::sqrt(3.0));
  const double top = std::exp(-0.5 * t);
  for (const char* sign : {"", "-"}) {
    const Json metrics =
        answer("step", std::string(R"({"num": [)") + sign + R"(1, 0], "den": [1, 1, 1]})")
            .at("metrics");
    EXPECT_NEAR(number(metrics, "peak"), *sign == '-' ? -top : top, 1e-10);
    EXPECT_NEAR(number(metrics, "peak_time"), t, 1e-7);
    EXPECT_EQ(number(metrics, "final_value"), 0.0);
    EXPECT_TRUE(metrics.at("rise_time").is_null());
    EXPECT_TRUE(metrics.at("overshoot").is_null());
  }
  const Json late =
      answer("step", R"j({"expr": "feedback(exp(-0.5s)*s/(s+1)^2, 0.1)"})j").at("metrics");
  EXPECT_GT(number(late, "peak_time"), 0.5);
  EXPECT_GT(number(late, "peak"), 0.3);
}

constexpr const char* third_order = R"("A": [[-1.017041847539126, -0.224182952826418,
    0.042538079149249], [-0.310374015319095, -0.516461581407780, -0.119195790221750],
    [-1.452723568727942, 1.7995860837102088, -1.491935830615152]],
    "B": [[0.312858596637428, -0.164879019209038], [-0.864879917324456, 0.627707287528727],
    [-0.030051296196269, 1.093265669039484]])";
constexpr const char* its_outputs = R"("C": [[1.109273297614398, 0.077359091130425,
    -1.113500741486764], [-0.863652821988714, -1.214117043615409, -0.006849328103348]])";

TEST(PeerNumbers, Norms) {
  const std::string plant = std::string("{") + third_order + ", " + its_outputs;
  for (const char* kind : {"hinf-norm", "linf-norm"}) {
    EXPECT_NEAR(number(answer(kind, plant + "}"), "norm"), 4.276759162964244, 1e-9) << kind;
  }
  EXPECT_NEAR(number(answer("h2-norm", plant + "}"), "norm"), 2.237461821810309, 1e-12);
  const Json sampled = answer("c2d", std::string("{") + third_order + R"(, "T": 0.1})");
  const std::string discrete = std::string(R"({"domain": "discrete", "T": 0.1, "A": )") +
                               sampled.at("A").dump() + R"(, "B": )" + sampled.at("B").dump() +
                               ", " + its_outputs + "}";
  EXPECT_NEAR(number(answer("hinf-norm", discrete), "norm"), 4.276759162964228, 1e-9);
  EXPECT_NEAR(number(answer("h2-norm", discrete), "norm"), 0.707434962289554, 1e-12);
  // Unstable, and on the axis.
  EXPECT_NEAR(number(answer("linf-norm", R"({"A": [[1]], "B": [[-1]], "C": [[1]]})"), "norm"), 1.0,
              1e-9);
  EXPECT_EQ(refusal("h2-norm", R"({"A": [[1]], "B": [[-1]], "C": [[1]]})"), "not_stable");
  EXPECT_EQ(refusal("linf-norm", R"({"A": [[0, 1], [-1, 0]], "B": [[0], [1]], "C": [[1, 0]]})"),
            "not_stable");
}

TEST(PeerNumbers, Gramians) {
  const std::string plant = R"({"A": [[1, -2], [3, -4]], "B": [[5, 6], [7, 8]],
      "C": [[4, 5], [6, 7]], "domain": "continuous"})";
  const Json continuous = answer("gramians", plant);
  expect_matrix(continuous, "Wc", Json({{18.5, 24.5}, {24.5, 32.5}}), 1e-12);
  expect_matrix(continuous, "Wo", Json({{257.5, -94.5}, {-94.5, 56.5}}), 1e-11);
  const Json s = answer("c2d", R"({"A": [[1, -2], [3, -4]], "B": [[5, 6], [7, 8]], "T": 0.2})");
  const Json discrete =
      answer("gramians", R"({"A": )" + s.at("A").dump() + R"(, "B": )" + s.at("B").dump() +
                             R"(, "C": [[4, 5], [6, 7]], "domain": "discrete"})");
  expect_matrix(discrete, "Wc", Json({{3.666767, 4.853625}, {4.853625, 6.435233}}), 1e-6);
  expect_matrix(discrete, "Wo", Json({{1305.369179, -440.046414}, {-440.046414, 333.034844}}),
                1e-6);
}

// (s³ + 11 s² + 45 s + 32)/(s⁴ + 15 s³ + 60 s² + 200 s + 60) in two states.
TEST(PeerNumbers, Reduction) {
  for (const char* kind : {"balanced-realization", "reduce"}) {
    const Json two = answer(kind, R"({"A": [[-15, -7.5, -6.25, -1.875], [8, 0, 0, 0],
        [0, 4, 0, 0], [0, 0, 1, 0]], "B": [[2], [0], [0], [0]],
        "C": [[0.5, 0.6875, 0.7031, 0.5]], "order": 2})");
    EXPECT_NEAR(entry(two, "A"), -1.958, 6e-4) << kind;
    EXPECT_NEAR(std::abs(entry(two, "A", 0, 1)), 1.194, 6e-4) << kind;
    EXPECT_NEAR(entry(two, "A", 1, 1), -0.8344, 6e-4) << kind;
    EXPECT_NEAR(std::abs(entry(two, "B")), 0.9057, 6e-5) << kind;
    EXPECT_NEAR(std::abs(entry(two, "C", 0, 1)), 0.4068, 6e-5) << kind;
  }
}

struct NyquistCase {
  const char* loop;
  int encirclements;
};

// Encirclements agree with the closed loop's poles, with poles on the axis, too.
TEST(PeerNumbers, NyquistCounts) {
  for (const NyquistCase& c : {NyquistCase{"10/(s^3+2s^2+2s+1)", 2},
                               {"1/(s*(s+1)*(s+2))", 0},
                               {"1/((s^2+3*s+2)*(s^2+1))", 2},
                               {"1/((s^2+3*s+2)*(s^2+1)*s)", 2},
                               {"1.4*exp(-s)/(s+1)^2", 0},
                               {"1/(s+0.6)^3", 0},
                               {"1/(s*(s+1)^2)", 0},
                               {"3*(s+6)^2/(s*(s+1)^2)", 0},
                               {"(0.02*s^3-0.1*s)/(s^4+s^3+s^2+0.25*s+0.04)", 0},
                               {"3*(0.02*s^3-0.1*s)/(s^4+s^3+s^2+0.25*s+0.04)", 2},
                               {"3/(s^4+2s^3+2s^2+s)", 2},
                               {"100*s/(s^2+2*s+2)^4", 2}}) {
    const std::string problem = std::string(R"({"expr": ")") + c.loop + "\"}";
    const Json curve = answer("nyquist", problem);
    EXPECT_EQ(curve.at("encirclements"), c.encirclements) << c.loop;
    EXPECT_EQ(curve.at("closed_loop_unstable"), c.encirclements) << c.loop;
    EXPECT_EQ(number(answer("closed-loop-poles", problem), "unstable"), c.encirclements) << c.loop;
  }
}

// Loops of gains and of systems, both signs.
TEST(PeerNumbers, BlockDiagrams) {
  const Json gains = answer("interconnect", R"({"G": "2.5", "H": "-3"})");
  EXPECT_NEAR(gains.at("feedback_neg").at("num")[0].get<double>() /
                  gains.at("feedback_neg").at("den")[0].get<double>(),
              -2.5 / 6.5, 1e-15);
  EXPECT_NEAR(gains.at("feedback_pos").at("num")[0].get<double>() /
                  gains.at("feedback_pos").at("den")[0].get<double>(),
              2.5 / 8.5, 1e-15);
  const Json loop = answer("interconnect", R"j({"G": "2.5", "H": "(s+2)/(s^2+2s+3)"})j");
  expect_list(loop.at("feedback_neg").at("num"), {2.5, 5.0, 7.5}, 1e-14, "num");
  expect_list(loop.at("feedback_neg").at("den"), {1.0, 4.5, 8.0}, 1e-14, "den");
  expect_list(loop.at("feedback_pos").at("den"), {1.0, -0.5, -2.0}, 1e-14, "den");
  const Json states = answer("feedback", R"({"forward": {"A": [[1, 4], [3, 2]], "B": [[1], [-4]],
      "C": [[1, 0]]}, "back": {"A": [[1, 4], [3, 2]], "B": [[1], [-4]], "C": [[1, 0]]}})");
  expect_matrix(states, "A", Json({{1, 4, -1, 0}, {3, 2, 4, 0}, {1, 0, 1, 4}, {-4, 0, 3, 2}}),
                1e-15);
}

}  // namespace
}  // namespace flyball::solve::peer_numbers_test
