// What the pictures of a tuning show, and when their time begins.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/study/analyze.hpp>
#include <flyball/study/simulate.hpp>

#include "fixtures.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/mechanism_animation.hpp"

namespace flyball::report::figures_test {
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

// Equal poles are all seen: a cross in a square in a diamond.
TEST(Figures, PolesOfEachGroupHaveAShapeOfTheirOwn) {
  const Answer answer = study::answer_of(design_result(MechanismKind::elevator));
  std::vector<LineStyle> styles;
  for (const PlotLine& line : named(answer, "poles").plot.panels.at(0).lines) {
    if (line.style != LineStyle::guide) {
      styles.push_back(line.style);
    }
  }
  EXPECT_EQ(styles, (std::vector{LineStyle::crosses, LineStyle::frames, LineStyle::diamonds}));
}

const MovingPart& part_of(const Animation& animation, const std::string& label) {
  const auto found = std::find_if(animation.parts.begin(), animation.parts.end(),
                                  [&](const MovingPart& part) { return part.label == label; });
  if (found == animation.parts.end()) {
    ADD_FAILURE() << "no part " << label;
    static const MovingPart none{};
    return none;
  }
  return *found;
}

// Every column is as long as the clock, every outline as long in x as in y, and the plots of its
// clock are there.
TEST(Figures, AMechanismMovesAsItWasSimulated) {
  for (const MechanismKind kind :
       {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm, MechanismKind::turret,
        MechanismKind::roller, MechanismKind::swerve_steer, MechanismKind::swerve_drive}) {
    for (const bool kA_determined : {true, false}) {
      if (!kA_determined && kind != MechanismKind::elevator && kind != MechanismKind::flywheel) {
        continue;
      }
      const study::DesignResult design = design_result(kind, kA_determined);
      const Answer answer = study::answer_of(design);
      ASSERT_EQ(answer.animations.size(), 1U) << to_string(kind);
      const Animation& animation = answer.animations[0];
      EXPECT_EQ(animation.section, "motion");
      EXPECT_EQ(animation.clock, named(answer, "closed_loop").plot.clock);
      EXPECT_EQ(animation.time, design.response.time());
      for (const MovingPart& part : animation.parts) {
        EXPECT_EQ(part.x.size(), part.y.size());
        EXPECT_FALSE(part.x.empty());
        for (const auto* column : {&part.to_x, &part.to_y, &part.angle}) {
          EXPECT_TRUE(column->empty() || column->size() == animation.time.size());
        }
        for (const auto* column : {&part.to_x, &part.to_y, &part.angle}) {
          EXPECT_TRUE(std::all_of(column->begin(), column->end(),
                                  [](double value) { return std::isfinite(value); }));
        }
      }
      const bool velocity = controls_velocity(kind);
      ASSERT_EQ(animation.values.size(), 2U);
      EXPECT_EQ(animation.values[0].values,
                *design.response.find(velocity ? "velocity" : "position"));
      EXPECT_EQ(animation.values[1].values,
                *design.response.find(velocity ? "reference_velocity" : "reference_position"));
    }
  }
  const study::DesignResult elevator = design_result(MechanismKind::elevator);
  const Animation lift = study::answer_of(elevator).animations.at(0);
  EXPECT_EQ(part_of(lift, "carriage").to_y, *elevator.response.find("position"));
  EXPECT_EQ(part_of(lift, "reference").to_y, *elevator.response.find("reference_position"));
  EXPECT_EQ(part_of(lift, "reference").style, PartStyle::outlined);
  // An arm is drawn at its true angle, which the sensor is 0.2 rad short of.
  const study::DesignResult arm = design_result(MechanismKind::arm);
  const Animation swings = study::answer_of(arm).animations.at(0);
  EXPECT_NEAR(part_of(swings, "arm").angle.back(), arm.response.find("position")->back() + 0.2,
              1e-12);
  // A wheel of two inches that rolls to the right turns clockwise; the needle of the largest
  // velocity stands 120° right of upright.
  const study::DesignResult drive = design_result(MechanismKind::swerve_drive);
  const Animation rolls = study::answer_of(drive).animations.at(0);
  EXPECT_NEAR(rolls.parts.at(0).angle.back(), -drive.response.find("position")->back() / 0.0508,
              1e-9);
  const std::vector<double>& needle = part_of(rolls, "velocity").angle;
  const std::vector<double>& reference = part_of(rolls, "reference").angle;
  const double least = std::min(*std::min_element(needle.begin(), needle.end()),
                                *std::min_element(reference.begin(), reference.end()));
  EXPECT_NEAR(least, std::numbers::pi / 2.0 - 2.0 * std::numbers::pi / 3.0, 1e-12);
}

TEST(Figures, AnAnimationOfALongMotionHasFewRowsAndItsEnd) {
  std::vector<double> time;
  std::vector<double> position;
  for (int i = 0; i < 100'001; ++i) {
    time.push_back(0.001 * i);
    position.push_back(std::sin(0.01 * i));
  }
  TimeSeries series(time);
  const study::DrawnMechanism arm{.kind = MechanismKind::arm, .name = "arm"};
  EXPECT_TRUE(study::mechanism_animation(arm, series).empty()) << "nothing is known of it";
  ASSERT_TRUE(series.add("position", "rad", position) && series.add("velocity", "rad/s", position));
  const auto made = study::mechanism_animation(arm, series);
  ASSERT_EQ(made.size(), 1U);
  EXPECT_LE(made[0].time.size(), 2001U);
  EXPECT_EQ(made[0].time.back(), time.back());
  EXPECT_EQ(part_of(made[0], "arm").angle.back(), position.back());
  // An open loop has no reference.
  EXPECT_EQ(made[0].values.size(), 1U);
  EXPECT_TRUE(std::none_of(made[0].parts.begin(), made[0].parts.end(), [](const MovingPart& part) {
    return part.style == PartStyle::outlined;
  }));
}

study::Project project(const std::string& text) {
  auto parsed = study::parse_project(text, "p.toml");
  EXPECT_TRUE(parsed) << to_string(parsed.error());
  return parsed ? *std::move(parsed) : study::Project{};
}

/// Two masses that are pushed and know nothing of each other; one of them alone.
const char* const masses =
    "[model]\nstates = { x = \"m\", v = \"m/s\", y = \"m\", w = \"m/s\" }\n"
    "inputs = { F = \"N\", G = \"N\" }\nparameters = { m = \"2 kg\" }\n"
    "[model.derivative]\nx = \"v\"\nv = \"F/m\"\ny = \"w\"\nw = \"G/m\"\n"
    "[controller]\nperiod = \"10 ms\"\ndelay = \"4 ms\"\n";
const char* const mass =
    "[model]\nstates = { x = \"m\", v = \"m/s\" }\ninputs = { F = \"N\" }\n"
    "parameters = { m = \"2 kg\" }\n[model.derivative]\nx = \"v\"\nv = \"F/m\"\n"
    "[controller]\nperiod = \"10 ms\"\ndelay = \"4 ms\"\n";

TEST(Figures, AModelsLoopIsDrawnOverFrequency) {
  const auto one = study::design_model(*project(mass).model_job);
  ASSERT_TRUE(one) << to_string(one.error());
  const Answer answer = study::answer_of(*one);
  const PlotPanel& gain = named(answer, "bode").plot.panels.at(0);
  const PlotPanel& phase = named(answer, "bode").plot.panels.at(1);
  // The margins come from another search than the curve: where they are marked it is at 0 dB, as
  // far above -180° as they say.
  ASSERT_TRUE(one->regulator.margins);
  const auto& crossing = one->regulator.margins->gain_crossovers.at(0);
  const auto& x = gain.lines.at(0).x;
  const auto i = static_cast<std::size_t>(std::lower_bound(x.begin(), x.end(), crossing.frequency) -
                                          x.begin());
  EXPECT_LE(gain.lines[0].y[i], 0.0);
  EXPECT_GE(gain.lines[0].y[i - 1], 0.0);
  EXPECT_NEAR(phase.lines.at(0).y[i], -180.0 + one->regulator.margins->phase_margin, 2.0);
  EXPECT_TRUE(std::any_of(phase.marks.begin(), phase.marks.end(), [&](const PlotMark& mark) {
    return mark.vertical && mark.at == crossing.frequency &&
           mark.label.starts_with("phase margin ");
  }));
  EXPECT_EQ(named(answer, "nyquist").plot.panels.at(0).lines.size(), 3U);
  // Of two that do not meet each loop is that of the one alone.
  const auto two = study::design_model(*project(masses).model_job);
  ASSERT_TRUE(two) << to_string(two.error());
  ASSERT_EQ(two->regulator.frequency_responses.size(), 2U);
  for (const auto& response : two->regulator.frequency_responses) {
    const auto& alone = one->regulator.frequency_responses.at(0);
    int compared = 0;  // each has frequencies of its own, and some in common
    for (const auto& at : response) {
      const auto same = std::find_if(alone.begin(), alone.end(), [&](const auto& other) {
        return std::abs(other.frequency - at.frequency) <= 1e-12 * at.frequency;
      });
      if (same != alone.end()) {
        EXPECT_NEAR(at.gain, same->gain, 1e-6 * same->gain);
        EXPECT_NEAR(at.phase, same->phase, 1e-6);
        ++compared;
      }
    }
    EXPECT_GE(compared, 10);
  }
  EXPECT_TRUE(named(study::answer_of(*two), "bode_G").title.ends_with("at G, the others closed"));
}

// G(s) = 1/(m s² + d s + k) with ω = 2 rad/s and ζ = 0.01: 1/k at rest, at ω 50 times that and a
// quarter of a turn late.
TEST(Figures, ALinearSystemIsDrawnOverFrequencyWithItsPeaks) {
  const auto model = study::parse_model(
      R"({"A": [[0, 1], [-4, -0.04]], "B": [[0], [1]], "C": [[1, 0]]})", "m.json");
  ASSERT_TRUE(model) << to_string(model.error());
  const auto analysis = study::analyze(*model);
  ASSERT_TRUE(analysis) << to_string(analysis.error());
  const Answer answer = study::answer_of(*analysis);
  const PlotLine& gain = named(answer, "bode").plot.panels.at(0).lines.at(0);
  const PlotLine& phase = named(answer, "bode").plot.panels.at(1).lines.at(0);
  EXPECT_NEAR(gain.y.front(), 20.0 * std::log10(0.25), 0.1);
  const auto at = std::find(gain.x.begin(), gain.x.end(), 2.0);
  ASSERT_NE(at, gain.x.end()) << "the mode's own frequency is among them";
  const auto i = static_cast<std::size_t>(at - gain.x.begin());
  EXPECT_NEAR(gain.y[i], 20.0 * std::log10(12.5), 1e-9);
  EXPECT_NEAR(phase.y[i], -90.0, 1e-9);
  EXPECT_NEAR(phase.y.back(), -180.0, 1.0);
  EXPECT_FALSE(named(answer, "nyquist").plot.panels.empty());
  // A discrete delay, z⁻¹, is a gain of one, half a turn late at Nyquist's frequency.
  const auto delay = study::parse_model(
      R"({"A": [[0]], "B": [[1]], "C": [[1]], "domain": "discrete", "T": 0.5})", "m.json");
  ASSERT_TRUE(delay) << to_string(delay.error());
  const auto looked = study::analyze(*delay);
  ASSERT_TRUE(looked) << to_string(looked.error());
  const Answer late = study::answer_of(*looked);
  const Plot& bode = named(late, "bode").plot;
  EXPECT_NEAR(bode.panels.at(0).lines.at(0).x.back(), 2.0 * std::numbers::pi, 1e-9);
  EXPECT_NEAR(bode.panels.at(0).lines.at(0).y.back(), 0.0, 1e-9);
  EXPECT_NEAR(bode.panels.at(1).lines.at(0).y.back(), -180.0, 1e-9);
}

// Plots of one time are linked; two states are also drawn over each other, in the order of time.
TEST(Figures, ASimulationsPlotsShareAClockAndItsStatesAPlane) {
  const auto simulation =
      study::simulate(project("[mechanism]\ntype = \"elevator\"\n[gains]\nkV = 2.0\nkA = 0.2\n"));
  ASSERT_TRUE(simulation) << to_string(simulation.error());
  const Answer answer = study::answer_of(*simulation);
  const std::string& clock = named(answer, "states").plot.clock;
  EXPECT_FALSE(clock.empty());
  EXPECT_EQ(named(answer, "inputs").plot.clock, clock);
  ASSERT_EQ(answer.animations.size(), 1U);
  EXPECT_EQ(answer.animations[0].clock, clock);
  EXPECT_EQ(answer.animations[0].section, "simulation");
  const Plot& plane = named(answer, "phase_plane").plot;
  EXPECT_TRUE(plane.clock.empty());
  EXPECT_EQ(plane.panels.at(0).lines.at(0).x, *simulation->series.find("position"));
  EXPECT_EQ(plane.panels.at(0).lines.at(0).y, *simulation->series.find("velocity"));
}

}  // namespace
}  // namespace flyball::report::figures_test
