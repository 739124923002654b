// What may be said of a profile, row by row, and a command line as a job.
#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/io/file.hpp>
#include <flyball/study/axes.hpp>

#include "core/try.hpp"
#include "study/field.hpp"
#include "study/toml_document.hpp"

namespace flyball::study {

namespace {

using enum Dimension;
using enum Range;

constexpr FieldDimension in_place = FieldDimension::output;
constexpr FieldDimension rate = FieldDimension::rate;
constexpr FieldDimension change = FieldDimension::acceleration;
constexpr const char* per_si = "NUMBER";

const std::array profile_rows{
    text("kind", at<&ProfileJob::kind>(), "\"s-curve\"", "The profile")
        .takes("KIND")
        .one_of("trapezoid, s-curve, exponential, parabolic, stepper, minimum-jerk")
        .without("chosen, and told why"),
    flag("angle", at<&ProfileJob::angle>(), "true", "It turns: positions are angles")
        .without("false: lengths"),
    flag("continuous", at<&ProfileJob::continuous>(), "true", "It may go either way round a circle")
        .without("false"),
    quantity("from", at<&ProfileJob::from, &MotionState::position>(), in_place, any, "\"0.2 m\"",
             "Where it is")
        .takes("POSITION")
        .without("0"),
    quantity("to", at<&ProfileJob::to, &MotionState::position>(), in_place, any, "\"1.4 m\"",
             "Where it is to be")
        .takes("POSITION")
        .without("0"),
    quantity("to_velocity", at<&ProfileJob::to_velocity>(), rate, any, "\"2 m/s\"",
             "In place of a position: how fast it is to be, wherever that is")
        .takes("VELOCITY")
        .without("it goes to a position"),
    quantity("start_velocity", at<&ProfileJob::from, &MotionState::velocity>(), rate, any,
             "\"0.5 m/s\"", "How fast it is there")
        .takes("VELOCITY")
        .without("0"),
    quantity("goal_velocity", at<&ProfileJob::to, &MotionState::velocity>(), rate, any,
             "\"0.5 m/s\"", "How fast it is to arrive")
        .takes("VELOCITY")
        .without("0"),
    quantity("start_acceleration", at<&ProfileJob::from, &MotionState::acceleration>(), change, any,
             "\"1 m/s^2\"", "What it accelerates with (s-curve, minimum-jerk)")
        .takes("ACCELERATION")
        .without("0"),
    quantity("goal_acceleration", at<&ProfileJob::to, &MotionState::acceleration>(), change, any,
             "\"1 m/s^2\"", "and with what it is to arrive")
        .takes("ACCELERATION")
        .without("0"),
    quantity("velocity", at<&ProfileJob::velocity>(), rate, positive, "\"1.5 m/s\"",
             "Limit of the velocity")
        .takes("VELOCITY")
        .without("the motor's"),
    quantity("acceleration", at<&ProfileJob::acceleration>(), change, positive, "\"3 m/s^2\"",
             "Limit of the acceleration")
        .takes("ACCELERATION")
        .without("the motor's"),
    quantity("deceleration", at<&ProfileJob::deceleration>(), change, positive, "\"2 m/s^2\"",
             "Limit of accelerations below zero")
        .takes("ACCELERATION")
        .without("as acceleration"),
    quantity("reverse_velocity", at<&ProfileJob::reverse_velocity>(), rate, positive, "\"1 m/s\"",
             "Limit of velocities below zero")
        .takes("VELOCITY")
        .without("as velocity"),
    quantity("ramp", at<&ProfileJob::ramp>(), time, positive, "\"0.1 s\"",
             "Time from no to full acceleration, which limits the jerk")
        .without("a quarter of the time to full velocity"),
    quantity("kV", at<&ProfileJob::kV>(), dimensionless, positive, "4.2",
             "Motor: volts per m/s or rad/s")
        .called("kv")
        .takes(per_si)
        .without("no motor"),
    quantity("kA", at<&ProfileJob::kA>(), dimensionless, positive, "0.4",
             "Motor: volts per m/s² or rad/s²")
        .called("ka")
        .takes(per_si)
        .without("needed with kV"),
    quantity("kS", at<&ProfileJob::kS>(), dimensionless, not_negative, "0.2",
             "Motor: volts of friction")
        .called("ks")
        .takes(per_si)
        .without("0"),
    quantity("kG", at<&ProfileJob::kG>(), dimensionless, any, "0.8",
             "Motor: volts that hold it against gravity")
        .called("kg")
        .takes(per_si)
        .without("0"),
    quantity("voltage", at<&ProfileJob::voltage>(), Dimension::voltage, positive, "\"12 V\"",
             "Motor: what may be applied")
        .without("12 V"),
    quantity("current", at<&ProfileJob::current>(), Dimension::current, positive, "\"80 A\"",
             "Motor: limit of the current of all motors, with their resistance")
        .without("none"),
    quantity("resistance", at<&ProfileJob::resistance>(), Dimension::resistance, positive,
             "\"50 mΩ\"", "Motor: of all motors")
        .without("needed with current"),
    quantity("jump", at<&ProfileJob::jump>(), rate, not_negative, "\"0.1 m/s\"",
             "Velocity at which a stepper profile starts and ends")
        .takes("VELOCITY")
        .without("0"),
    flag("step_motor", at<&ProfileJob::step_motor>(), "true", "To choose: a step motor turns it")
        .without("false"),
    flag("delicate", at<&ProfileJob::delicate>(), "true",
         "To choose: what it carries must not be jostled")
        .without("false"),
    quantity("resonance", at<&ProfileJob::resonance>(), frequency, positive, "\"6 Hz\"",
             "To choose: what swings when it moves")
        .without("none"),
    quantity("period", at<&ProfileJob::period>(), time, positive, "\"20 ms\"",
             "Time between two rows of the table")
        .without("20 ms")};

constexpr std::string_view profile_section_name = "profile";

/// The keys of one of several axes: S-curves, without what chooses another kind.
std::vector<Field> axis_rows() {
  std::vector<Field> all{text("name", at<&ProfileJob::name>(), "\"lift\"", "What it is called")};
  for (const std::string_view key :
       {"angle", "continuous", "from", "to", "start_velocity", "goal_velocity",
        "start_acceleration", "goal_acceleration", "velocity", "acceleration", "deceleration",
        "reverse_velocity", "ramp"}) {
    for (const Field& field : profile_rows) {
      if (field.key == key) {
        all.push_back(field);
      }
    }
  }
  return all;
}

Expected<void> check_synchronization(const std::string& text) {
  if (text == "time" || text == "phase") {
    return {};
  }
  return refusal(ArgumentError::unknown_name, {}, fmt::format("\"{}\"", text))
      .got("not one of the choices")
      .expected("time, phase");
}

const std::array group_rows{text("synchronize", at<&AxesJob::synchronize>(), "\"phase\"",
                                 "Whether they arrive at once or move along a straight line")
                                .takes("HOW")
                                .one_of("time, phase")
                                .checked(check_synchronization)
                                .without("time"),
                            quantity("least", at<&AxesJob::least>(), time, not_negative, "\"2 s\"",
                                     "They take at least so long")
                                .without("as fast as they can"),
                            quantity("period", at<&AxesJob::period>(), time, positive, "\"20 ms\"",
                                     "Time between two rows of the table")
                                .without("20 ms")};

std::optional<SignalDimensions> profile_dimensions_of(const void* document) {
  const bool turns = static_cast<const ProfileJob*>(document)->angle;
  return turns ? SignalDimensions{{}, Dimension::angle, angular_velocity, angular_acceleration}
               : SignalDimensions{{}, length, Dimension::velocity, Dimension::acceleration};
}

std::string profile_example_of(const Field& field) {
  std::string example(field.example);
  std::erase(example, '"');
  return example.find(' ') == std::string::npos ? example : "'" + example + "'";
}

}  // namespace

std::vector<FieldInfo> profile_fields() {
  std::vector<FieldInfo> all;
  for (const Field& field : profile_rows) {
    const std::string value = !field.metavar.empty()                   ? std::string(field.metavar)
                              : field.type == FieldType::flag          ? ""
                              : field.dimension.dimension == time      ? "TIME"
                              : field.dimension.dimension == frequency ? "FREQUENCY"
                              : field.dimension.dimension == Dimension::voltage ? "VOLTAGE"
                              : field.dimension.dimension == Dimension::current ? "CURRENT"
                                                                                : "RESISTANCE";
    all.push_back({.section = std::string(profile_section_name),
                   .key = std::string(field.key),
                   .option = option_of(field),
                   .value = value,
                   .help = std::string(field.help),
                   .example = profile_example_of(field),
                   .absent = std::string(field.absent)});
  }
  return all;
}

ExpectedAll<ProfileJob> profile_job(std::span<const Override> given) {
  const std::array sections{Section{profile_section_name, profile_rows,
                                    [](void* document, bool) { return document; },
                                    "What is asked of a profile."}};
  const Document table{sections, profile_dimensions_of};
  TomlDocument document("", "");
  document.apply(given, sections);
  ProfileJob job;
  // The unit of a position hangs on it.
  job.angle = std::any_of(given.begin(), given.end(), [](const Override& option) {
    return option.option == "--angle" && option.text != "false";
  });
  document.read(table, &job);
  if (auto errors = document.errors()) {
    return tl::unexpected(*std::move(errors));
  }
  return job;
}

ExpectedAll<AxesJob> axes_job_of(std::string_view text, const std::string& path,
                                 std::span<const Override> given) {
  constexpr std::string_view axis_name = "axis";
  const std::vector<Field> axis_fields = axis_rows();
  const std::array group{Section{profile_section_name, group_rows,
                                 [](void* document, bool) { return document; }, "Of all axes."}};
  const std::array axis{Section{axis_name, axis_fields,
                                [](void* document, bool) { return document; }, "One of the axes."}};
  AxesJob job{.path = path};
  std::vector<QuotedError> errors;
  const auto keep = [&](TomlDocument& document) {
    if (auto found = document.errors()) {
      for (QuotedError& error : found->all()) {
        errors.push_back(std::move(error));
      }
    }
  };
  TomlDocument rest(text, path);
  std::vector<TomlDocument> tables = rest.take_tables(axis_name);
  const std::size_t count = tables.size();
  rest.apply(given, group);
  rest.read({group, [](const void*) { return std::optional(SignalDimensions{}); }}, &job);
  keep(rest);
  if (count > most_axes) {
    errors.push_back({Error(ProjectError::wrong_value)
                          .about("[[axis]]")
                          .got(fmt::format("there {} times", count))
                          .in(path)
                          .expected(fmt::format("at most {} axes", most_axes)),
                      {},
                      {}});
    tables.clear();
  }
  for (TomlDocument& table : tables) {
    ProfileJob one;
    one.angle = table.says(axis_name, "angle");  // The unit of a position hangs on it.
    table.read({axis, profile_dimensions_of}, &one);
    keep(table);
    if (one.name.empty()) {
      one.name = fmt::format("axis {}", job.axes.size() + 1);
    }
    job.axes.push_back(std::move(one));
  }
  if (count == 0 && errors.empty()) {
    errors.push_back({Error(ProjectError::missing_key)
                          .about("[[axis]]")
                          .got("missing")
                          .in(path)
                          .hint("give each axis a table: [[axis]] name = \"lift\", to = \"1.2 m\", "
                                "velocity = \"1.5 m/s\", acceleration = \"3 m/s^2\""),
                      {},
                      {}});
  }
  if (!errors.empty()) {
    return tl::unexpected(Errors(std::move(errors)));
  }
  return job;
}

ExpectedAll<AxesJob> axes_job(const std::string& path, std::span<const Override> given) {
  constexpr std::size_t most_bytes = std::size_t{4} << 20;
  const auto text = read_file(path, most_bytes);
  if (!text) {
    return tl::unexpected(Errors(text.error()));
  }
  return axes_job_of(*text, path, given);
}

}  // namespace flyball::study
