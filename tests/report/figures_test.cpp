// What the pictures of a tuning show, and when their time begins.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "study/answer/drawing.hpp"

namespace flyball::report {
namespace {

const Figure& named(const Answer& answer, const std::string& name) {
  const auto found = std::find_if(answer.figures.begin(), answer.figures.end(),
                                  [&](const Figure& figure) { return figure.name == name; });
  if (found == answer.figures.end()) {
    ADD_FAILURE() << "no figure " << name;
    static const Figure none{};
    return none;
  }
  return *found;
}

// A session whose clock began an hour ago, as a robot's does.
TEST(Figures, TimeStartsWithTheTestAndWhatTheFitLeavesOutIsMarked) {
  identification::Recording recording =
      record_characterization(session(MechanismKind::elevator)).value();
  for (identification::TestRun& run : recording.runs) {
    for (double& time : run.time) {
      time += 3600.0;
    }
  }
  const study::IdentifyResult result = identify_result(recording);
  const Answer answer = study::answer_of(result);
  ASSERT_TRUE(result.report.fit);
  for (const identification::FittedRun& run : result.report.fit->runs) {
    ASSERT_TRUE(run.used);
    const std::string name =
        "fit_" + std::to_string(run.source + 1) + "_" + std::string(to_string(run.kind));
    const Plot& plot = named(answer, name).plot;
    const std::vector<double>& whole = recording.runs[run.source].time;
    const PlotPanel& voltage = plot.panels.at(2);
    EXPECT_NEAR(voltage.lines[0].x.front(), 0.0, 1e-9);
    EXPECT_NEAR(voltage.lines[0].x.back(), whole.back() - whole.front(), 1e-9);
    // Measured and simulated are told apart in grey.
    const PlotPanel& velocity = plot.panels.at(0);
    const auto line = [&](const std::string& label) {
      return *std::find_if(velocity.lines.begin(), velocity.lines.end(),
                           [&](const PlotLine& l) { return l.label == label; });
    };
    EXPECT_NE(line("measured").style, line("simulated").style);
    EXPECT_NEAR(line("measured").x.front(), run.time.front() - whole.front(), 1e-9);
    // Every row is used or in a stretch that is marked.
    for (const double time : voltage.lines[0].x) {
      const bool used = time >= line("measured").x.front() && time <= line("measured").x.back();
      const bool marked =
          std::any_of(velocity.spans.begin(), velocity.spans.end(),
                      [&](const PlotSpan& span) { return time >= span.from && time <= span.to; });
      EXPECT_TRUE(used || marked) << time;
    }
    const PlotLine& residual = plot.panels.at(1).lines[0];
    ASSERT_LE(residual.x.size(), run.fresh.size());
    const std::size_t left_out = run.fresh.size() - residual.x.size();
    EXPECT_EQ(residual.y.front(), run.velocity_residual[run.fresh[left_out]]);
    // Of runs that begin in motion a tenth of a second is not compared.
    EXPECT_EQ(left_out > 0, !result.report.prepared.runs[run.source].starts_at_rest);
  }
}

// The elevator speeds up within kA/kV = 75 ms, the step lasts a second and more.
TEST(Figures, AShortTransientHasAWindowOfItsOwn) {
  const Answer answer = study::answer_of(identify_result(MechanismKind::elevator));
  const Figure& whole = named(answer, "fit_3_dynamic-forward");
  const Figure& window = named(answer, "fit_3_dynamic-forward_transient");
  const auto span = [](const Figure& figure) {
    const std::vector<double>& x = figure.plot.panels.at(2).lines[0].x;
    return x.back() - x.front();
  };
  EXPECT_LT(span(window), 0.7 * span(whole));
  EXPECT_GT(span(window), 0.075);

  // A ramp has none; a step that is over at once neither, since it has no length.
  std::vector<double> time;
  std::vector<double> ramp;
  std::vector<double> step;
  std::vector<double> rise;
  for (int i = 0; i < 1000; ++i) {
    time.push_back(0.01 * i);
    ramp.push_back(i);
    step.push_back(i < 500 ? 0.0 : 1.0);
    rise.push_back(i < 500 ? 0.0 : 1.0 - std::exp(-(i - 500) / 10.0));
  }
  EXPECT_FALSE(study::transient_of(time, ramp));
  EXPECT_FALSE(study::transient_of(time, std::vector<double>(1000, 3.0)));
  EXPECT_FALSE(study::transient_of({}, {}));
  const auto found = study::transient_of(time, rise);
  ASSERT_TRUE(found);
  // Four fifths of 1 - e^{-t/τ}, τ = 0.1 s, are over after τ ln 5 = 161 ms, 17 samples; half of
  // that is before, as much follows.
  EXPECT_NEAR(found->low, 5.0 - 0.5 * 0.17, 0.011);
  EXPECT_NEAR(found->high, 5.0 + 2.0 * 0.17, 0.011);
}

TEST(Figures, TheLoopsBodePlotShowsItsMargins) {
  const study::DesignResult design = design_result(MechanismKind::elevator);
  const Answer answer = study::answer_of(design);
  const Plot& bode = named(answer, "bode").plot;
  const PlotLine& gain = bode.panels.at(0).lines[0];
  const PlotLine& phase = bode.panels.at(1).lines[0];
  EXPECT_TRUE(bode.log_x);
  EXPECT_NEAR(gain.x.back(), std::numbers::pi / design.job.controller.period, 1e-9);
  const auto at = [](const PlotLine& line, double x) {
    const auto after = std::lower_bound(line.x.begin(), line.x.end(), x);
    const auto i = static_cast<std::size_t>(after - line.x.begin());
    const double share = std::log(x / line.x[i - 1]) / std::log(line.x[i] / line.x[i - 1]);
    return line.y[i - 1] + share * (line.y[i] - line.y[i - 1]);
  };
  // The margins come from another search than the curve.
  EXPECT_NEAR(at(gain, design.margins.crossover), 0.0, 0.05);
  EXPECT_NEAR(at(phase, design.margins.crossover),
              -180.0 + design.margins.phase_margin * 180.0 / std::numbers::pi, 0.5);
  bool told = false;
  for (const PlotMark& mark : bode.panels[0].marks) {
    if (mark.label.starts_with("gain margin ")) {
      told = true;
      EXPECT_NEAR(at(gain, mark.at), -20.0 * std::log10(design.margins.gain_margin), 0.1);
    }
  }
  EXPECT_TRUE(told);
  // The same in the plane: the curve ends at the same gain.
  const PlotLine& nyquist = named(answer, "nyquist").plot.panels.at(0).lines[0];
  EXPECT_NEAR(std::hypot(nyquist.x.back(), nyquist.y.back()), std::pow(10.0, gain.y.back() / 20.0),
              1e-9);
}

TEST(Figures, ASmallStepEndsAtOneAndSettlesWhereItSays) {
  const study::DesignResult design = design_result(MechanismKind::arm);
  ASSERT_TRUE(design.loop.settling_time);
  EXPECT_NEAR(design.loop.step.back(), 1.0, 1e-6);
  const double overshoot =
      *std::max_element(design.loop.step.begin(), design.loop.step.end()) - 1.0;
  EXPECT_NEAR(std::max(0.0, overshoot), design.loop.overshoot, 1e-9);
  for (std::size_t i = 0; i < design.loop.step.size(); ++i) {
    if (design.loop.step_time[i] > *design.loop.settling_time + 1e-9) {
      EXPECT_NEAR(design.loop.step[i], 1.0, 0.02 + 1e-9);
    }
  }
  const Answer answer = study::answer_of(design);
  const PlotLine& drawn = named(answer, "small_step").plot.panels.at(0).lines[0];
  EXPECT_EQ(drawn.y.front(), design.loop.step.front());
}

TEST(Figures, IntervalsStandAsSharesOfTheirValues) {
  const study::IdentifyResult result = identify_result(MechanismKind::elevator);
  const Answer answer = study::answer_of(result);
  const Plot& plot = named(answer, "intervals").plot;
  const identification::GainEstimate& kV = result.report.fit->kV;
  const PlotPanel& panel = plot.panels.at(0);
  ASSERT_GE(panel.y_ticks.size(), 4U);
  EXPECT_TRUE(panel.y_ticks[1].label.starts_with("kV "));
  const PlotLine& intervals = panel.lines.at(0);
  EXPECT_NEAR(intervals.x[3], 100.0 * (kV.interval[0] / kV.value - 1.0), 1e-9);
  EXPECT_EQ(intervals.y[3], panel.y_ticks[1].at);
  // Without a fit there is nothing to be sure of.
  for (const Figure& figure : study::answer_of(refused_result()).figures) {
    EXPECT_NE(figure.name, "intervals");
  }
}

}  // namespace
}  // namespace flyball::report
