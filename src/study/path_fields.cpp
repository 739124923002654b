// What may be said of a path, row by row, and a command line as a job.
#include <algorithm>
#include <array>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/study/path.hpp>

#include "core/try.hpp"
#include "study/field.hpp"
#include "study/toml_document.hpp"

namespace flyball::study {

namespace {

using enum Dimension;
using enum Range;

Expected<void> check_format(const std::string& text) {
  constexpr std::array<std::string_view, 6> known{"choreo", "wpilib",      "csv",
                                                  "c++",    "pathplanner", "choreo-project"};
  if (std::find(known.begin(), known.end(), text) != known.end()) {
    return {};
  }
  const std::string near = nearest_name(text, known);
  return refusal(ArgumentError::unknown_name, {}, "the format")
      .got("\"" + cut(printable(text), 40) + "\"")
      .expected("choreo, wpilib, csv, c++, pathplanner or choreo-project")
      .hint(near.empty() ? "" : "did you mean \"" + near + "\"?");
}

const std::array path_rows{
    text("to", at<&PathJob::to>(), "\"choreo\"",
         "Write it in this format, to --out or the terminal")
        .one_of("choreo, wpilib, csv, c++, pathplanner, choreo-project")
        .checked(check_format)
        .takes("FORMAT")
        .without("told and drawn"),
    text("name", at<&PathJob::name>(), "\"backup2m\"", "Which path, of a file that has several")
        .takes("NAME")
        .without("the only one"),
    flag("flip", at<&PathJob::flip>(), "true", "Turn it by half a turn about the field's middle")
        .without("false"),
    flag("mirror", at<&PathJob::mirror>(), "true", "Mirror it at the line between the alliances")
        .without("false"),
    flag("mirror_sides", at<&PathJob::mirror_sides>(), "true",
         "Mirror it at the line along the field's middle")
        .without("false"),
    flag("reverse", at<&PathJob::reverse>(), "true", "Drive it from its end to its start, backing")
        .without("false"),
    flag("retime", at<&PathJob::retime>(), "true",
         "Make a trajectory's times anew; limits do so, too")
        .without("false"),
    flag("differential", at<&PathJob::differential>(), "true", "The robot looks where it goes")
        .without("as the robot or the file says"),
    quantity("velocity", at<&PathJob::velocity>(), Dimension::velocity, positive, "\"3 m/s\"",
             "Limit of the velocity")
        .without("the file's"),
    quantity("acceleration", at<&PathJob::acceleration>(), Dimension::acceleration, positive,
             "\"3 m/s^2\"", "Limit of the acceleration, along and across the path together")
        .without("the file's"),
    quantity("centripetal", at<&PathJob::centripetal>(), Dimension::acceleration, positive,
             "\"2 m/s^2\"", "Limit of the acceleration across the path")
        .without("that of the acceleration"),
    quantity("angular_velocity", at<&PathJob::angular_velocity>(), Dimension::angular_velocity,
             positive, "\"360 deg/s\"", "Limit of the turning rate")
        .without("the file's"),
    quantity("angular_acceleration", at<&PathJob::angular_acceleration>(),
             Dimension::angular_acceleration, positive, "\"720 deg/s^2\"",
             "Limit of the angular acceleration")
        .without("the file's"),
    quantity("ramp", at<&PathJob::ramp>(), Dimension::time, positive, "\"200 ms\"",
             "Time from no to full acceleration, which limits the jerk along and across the path")
        .without("none: the jerk is not limited"),
    quantity("start_velocity", at<&PathJob::start_velocity>(), Dimension::velocity, not_negative,
             "\"1 m/s\"", "How fast it starts")
        .without("the file's, or 0"),
    quantity("end_velocity", at<&PathJob::end_velocity>(), Dimension::velocity, not_negative,
             "\"1 m/s\"", "How fast it ends")
        .without("the file's, or 0"),
    quantity("field_length", at<&PathJob::field_length>(), length, positive, "\"16.54 m\"",
             "Of the field, to flip and mirror")
        .without("17.548 m, that of 2025"),
    quantity("field_width", at<&PathJob::field_width>(), length, positive, "\"8.02 m\"",
             "Of the field, to flip and mirror")
        .without("8.052 m, that of 2025")};

constexpr std::string_view path_section_name = "path";

std::optional<SignalDimensions> path_dimensions_of(const void*) {
  return SignalDimensions{{}, length, Dimension::velocity, Dimension::acceleration};
}

std::string path_example_of(const Field& field) {
  std::string example(field.example);
  std::erase(example, '"');
  return example.find(' ') == std::string::npos ? example : "'" + example + "'";
}

std::string value_of(const Field& field) {
  if (!field.metavar.empty() || field.type == FieldType::flag) {
    return std::string(field.metavar);
  }
  switch (field.dimension.dimension) {
    case length:
      return "LENGTH";
    case Dimension::velocity:
      return "VELOCITY";
    case Dimension::acceleration:
      return "ACCELERATION";
    case angular_velocity:
      return "RATE";
    case Dimension::time:
      return "TIME";
    default:
      return "QUANTITY";
  }
}

}  // namespace

std::vector<FieldInfo> path_fields() {
  std::vector<FieldInfo> all;
  for (const Field& field : path_rows) {
    all.push_back({.section = std::string(path_section_name),
                   .key = std::string(field.key),
                   .option = option_of(field),
                   .value = value_of(field),
                   .help = std::string(field.help),
                   .example = path_example_of(field),
                   .absent = std::string(field.absent)});
  }
  return all;
}

ExpectedAll<PathJob> path_job(const std::vector<std::string>& files,
                              std::span<const Override> given) {
  const std::array sections{Section{path_section_name, path_rows,
                                    [](void* document, bool) { return document; },
                                    "What is asked of a path."}};
  const Document table{sections, path_dimensions_of};
  TomlDocument document("", "");
  document.apply(given, sections);
  PathJob job;
  document.read(table, &job);
  if (auto errors = document.errors()) {
    return tl::unexpected(*std::move(errors));
  }
  for (const std::string& file : files) {
    if (!file.ends_with(".toml")) {
      job.files.push_back(file);
    } else if (job.project.empty()) {
      job.project = file;
    } else {
      return tl::unexpected(Errors(Error(ArgumentError::ambiguous_name)
                                       .in(file)
                                       .about("the robot")
                                       .got("a second project file")
                                       .expected("one")));
    }
  }
  return job;
}

}  // namespace flyball::study
