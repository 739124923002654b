#pragma once

#include <algorithm>
#include <array>
#include <initializer_list>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/study/project.hpp>

#include "core/try.hpp"
#include "study/field.hpp"

/// The keys of a model by formula: [model], [point], [simulation], [fit], [estimate], [swing_up].
namespace flyball::study {

/// @errors ArgumentError::unknown_name for a text that is none of the choices.
[[nodiscard]] inline Expected<void> check_choice(const std::string& text,
                                                 std::initializer_list<std::string_view> choices) {
  if (std::find(choices.begin(), choices.end(), text) != choices.end()) {
    return {};
  }
  return refusal(ArgumentError::unknown_name, {}, fmt::format("\"{}\"", text))
      .got("not one of the choices")
      .expected(fmt::format("{}", fmt::join(choices, ", ")));
}

inline constexpr std::array model_fields{
    text("name", at<&FormulaSection::name>(), "\"pendulum\"", "What it is called")
        .without("model")
        .no_option(),
    map("states", at<&FormulaSection::states>(), "{ theta = \"rad\", omega = \"rad/s\" }",
        "Each state's unit; \"1\" for a plain number")
        .without("it must be there")
        .no_option(),
    map("inputs", at<&FormulaSection::inputs>(), "{ u = \"N m\" }", "Each input's unit")
        .without("none")
        .no_option(),
    map("parameters", at<&FormulaSection::parameters>(),
        "{ g = \"9.81 m/s^2\", l = \"0.5 m\", m = \"2 kg\" }", "Each constant's value and unit")
        .without("none")
        .takes("NAME=VALUE,…"),
    names("angles", at<&FormulaSection::angles>(), "[\"theta\"]",
          "States whose values repeat after a turn")
        .without("those in an angle's unit")
        .no_option(),
    map("definitions", at<&FormulaSection::definitions>(), "{ J = \"m*l^2\" }",
        "Named parts of formulas, each usable by those after it")
        .without("none")
        .no_option(),
    map("derivative", at<&FormulaSection::derivative>(),
        "{ theta = \"omega\", omega = \"-g/l*sin(theta) + u/J\" }",
        "Each state's change per second, a formula ([formulas](formulas.md))")
        .without("it must be there")
        .no_option(),
    map("outputs", at<&FormulaSection::outputs>(), "{ angle = \"theta\" }",
        "What is measured, formulas")
        .without("the states")
        .no_option()};

inline constexpr std::array point_fields{
    map("at", at<&PointSection::at>(), "{ theta = \"180 deg\", u = \"0 N m\" }",
        "Values of states and inputs")
        .called("point")
        .without("zero"),
    flag("find_equilibrium", at<&PointSection::find_equilibrium>(), "true",
         "Whether the equilibrium near it, with the same inputs, is taken instead")
        .without("false")};

inline constexpr std::array simulation_fields{
    quantity("duration", at<&SimulationSection::duration>(), Dimension::time, Range::positive,
             "\"5 s\"", "How long is simulated")
        .without("10 s; of a mechanism its motion"),
    quantity("step", at<&SimulationSection::step>(), Dimension::time, Range::positive, "\"10 ms\"",
             "Time between the rows of an open loop's record")
        .without("a thousandth of the duration"),
    quantity("accuracy", at<&SimulationSection::accuracy>(), Dimension::dimensionless,
             Range::positive, "1e-8", "Relative accuracy of a step of the integration")
        .without("1e-8")
        .of(Subject::model),
    flag("closed_loop", at<&SimulationSection::closed_loop>(), "true",
         "Whether the controller acts: LQR about the point")
        .without("false; of a mechanism without input true"),
    map("initial", at<&SimulationSection::initial>(), "{ theta = \"10 deg\" }",
        "The states at the start; a mechanism's are position and velocity")
        .without("the point; of a mechanism zero"),
    map("input", at<&SimulationSection::input>(), "{ u = \"if(t < 1, 0.5, 0)\" }",
        "The inputs of an open loop: a value with its unit, or a formula of the time t in seconds "
        "and the parameters, in SI; a mechanism's is voltage")
        .without("the point; of a mechanism zero"),
    map("noise", at<&SimulationSection::noise>(), "{ theta = \"0.1 deg\" }",
        "Standard deviation of each reading of an output, in a closed loop")
        .without("none")
        .of(Subject::model),
    map("resolution", at<&SimulationSection::resolution>(), "{ theta = \"0.1 deg\" }",
        "Smallest step of an output's readings, in a closed loop")
        .called("reading-step")
        .without("none")
        .of(Subject::model)};

[[nodiscard]] inline Expected<void> check_hold(const std::string& text) {
  return check_choice(text, {"held", "linear", "cubic"});
}

[[nodiscard]] inline Expected<void> check_loss(const std::string& text) {
  return check_choice(text, {"squared", "soft_l1", "huber", "cauchy", "tukey"});
}

inline constexpr std::array fit_fields{
    map("free", at<&FitSection::free>(), "{ k = \"0 .. 10 N/m\", b = \"free\" }",
        "Parameters that are looked for, each with its range (\"free\", \"0 .. 10 N/m\", "
        "\">= 0 N/m\") or what is known of it (\"5 N/m ± 1 N/m\"); [model] says where they start")
        .without("none")
        .no_option(),
    map("channels", at<&FitSection::channels>(), "{ u = \"/Arm/AppliedVolts\" }",
        "The log's channel of an input or an output of the model")
        .without("the one of its name")
        .no_option(),
    map("validation_channels", at<&FitSection::validation_channels>(),
        "{ u = \"uVal\", y = \"yVal\" }", "The same of a recording that the fit does not see")
        .without("none")
        .no_option(),
    quantity("period", at<&FitSection::period>(), Dimension::time, Range::positive, "\"4 s\"",
             "Time between the rows of a table that has no column of time")
        .called("row-period")
        .without("the log's own time"),
    quantity("from", at<&FitSection::from>(), Dimension::time, Range::any, "\"2 s\"",
             "Where the part of the log begins that is fitted")
        .without("the log's start"),
    quantity("to", at<&FitSection::to>(), Dimension::time, Range::any, "\"30 s\"", "Where it ends")
        .without("the log's end"),
    quantity("validation_from", at<&FitSection::validation_from>(), Dimension::time, Range::any,
             "\"30 s\"",
             "Where the part begins that is kept aside to check the fit, which does not see it")
        .without("none"),
    quantity("validation_to", at<&FitSection::validation_to>(), Dimension::time, Range::any,
             "\"60 s\"", "Where it ends")
        .without("the log's end"),
    map("initial", at<&FitSection::initial>(), "{ theta = \"10 deg\" }",
        "The states at the first sample, where the search begins for free ones")
        .called("fit-initial")
        .without("the point")
        .no_option(),
    names("free_initial", at<&FitSection::free_initial>(), "[\"theta\"]",
          "States whose value at the first sample is looked for")
        .without("none")
        .no_option(),
    flag("same_initial", at<&FitSection::same_initial>(), "true",
         "Whether the part that is kept aside begins at the states found for the fit")
        .without("false: free ones are found anew"),
    text("hold", at<&FitSection::hold>(), "\"linear\"", "What an input does between its samples")
        .one_of("held, linear, cubic")
        .checked(check_hold)
        .without("held"),
    text("loss", at<&FitSection::loss>(), "\"soft_l1\"", "How large errors count")
        .one_of("squared, soft_l1, huber, cauchy, tukey")
        .checked(check_loss)
        .without("squared"),
    whole("starts", at<&FitSection::starts>(), 1, 10000, "8",
          "From how many places of the ranges the search starts, the model's own values the first")
        .without("1"),
    whole("seed", at<&FitSection::seed>(), 0, largest_whole, "1", "Which places these are")
        .called("start-seed"),
    flag("profile", at<&FitSection::profile>(), "true",
         "Whether intervals come from the profile of the likelihood")
        .without("false")};

[[nodiscard]] inline Expected<void> check_filter(const std::string& text) {
  return check_choice(text, {"extended", "unscented"});
}

[[nodiscard]] inline Expected<void> check_outliers(const std::string& text) {
  return check_choice(text, {"none", "gate", "huber", "student"});
}

inline constexpr std::array estimate_fields{
    text("filter", at<&EstimateSection::filter>(), "\"unscented\"", "Which Kalman filter")
        .one_of("extended, unscented")
        .checked(check_filter)
        .without("extended"),
    flag("smoother", at<&EstimateSection::smoother>(), "true",
         "Whether the record is smoothed, too (Rauch, Tung and Striebel)")
        .without("true"),
    map("process_noise", at<&EstimateSection::process_noise>(), "{ omega = \"0.5 rad/s\" }",
        "How far a state errs in one second, as a random walk: standard deviation")
        .without("none")
        .no_option(),
    map("measurement_noise", at<&EstimateSection::measurement_noise>(), "{ theta = \"1 deg\" }",
        "Standard deviation of a reading of each output")
        .without("it must be there")
        .no_option(),
    map("initial", at<&EstimateSection::initial>(), "{ theta = \"10 deg\" }",
        "The states at the first sample")
        .without("the point")
        .no_option(),
    map("initial_std", at<&EstimateSection::initial_std>(), "{ theta = \"5 deg\" }",
        "How far they may be off: standard deviation")
        .without("1 in the state's SI unit")
        .no_option(),
    map("lower_limit", at<&EstimateSection::lower_limit>(), "{ height = \"0 m\" }",
        "Where a state always is at least, as above a stop")
        .without("none")
        .no_option(),
    map("upper_limit", at<&EstimateSection::upper_limit>(), "{ height = \"48 in\" }",
        "Where it always is at most")
        .without("none")
        .no_option(),
    text("outliers", at<&EstimateSection::outliers>(), "\"huber\"",
         "What becomes of a reading that does not fit: it is taken, left out, or counts for less")
        .one_of("none, gate, huber, student")
        .checked(check_outliers)
        .without("none"),
    flag("tune", at<&EstimateSection::tune>(), "true",
         "Whether the standard deviations of process and measurement noise are found first, by "
         "maximum likelihood from where they are; what is zero stays")
        .called("tune-noise")
        .without("false")};

inline constexpr std::array swing_up_fields{
    text("energy", at<&SwingUpSection::energy>(), "\"J*omega^2/2 - m*g*l*cos(theta)\"",
         "What swings: a formula of the states ([formulas](formulas.md)) whose value at the point "
         "is "
         "what it is brought to; of a cart-pole that of the pole")
        .without("no swing-up")
        .no_option(),
    map("hold", at<&SwingUpSection::hold>(), "{ x = \"10 N/m\", v = \"10 N s/m\" }",
        "Meanwhile, the input that holds states at the point, for each unit that one is off")
        .without("none")
        .no_option(),
    map("reach", at<&SwingUpSection::reach>(), "{ x = \"2 m\" }",
        "How far from the point a state may be, such as to the end of a track")
        .without("as far as it goes")
        .no_option(),
    quantity("sharpness", at<&SwingUpSection::sharpness>(), Dimension::dimensionless,
             Range::positive, "10",
             "The input is at its limit while more than one over this of the energy is missing")
        .without("10")
        .of(Subject::model)};

}  // namespace flyball::study
