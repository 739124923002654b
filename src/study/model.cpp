#include <algorithm>

#include <fmt/format.h>

#include <flyball/io/file.hpp>
#include <flyball/study/analyze.hpp>
#include <flyball/systems/linearize.hpp>

#include "core/controls.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "solve/json_object.hpp"
#include "solve/row.hpp"
#include "study/design_steps.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;

constexpr std::size_t largest_model = std::size_t{64} << 20;

/// The coordinates that a field names, each as its label or by its name alone; none where the field
/// is left out.
Expected<std::vector<Coordinate>> read_coordinates(const std::vector<std::string>& names,
                                                   Eigen::Index count, const std::string& where,
                                                   std::string_view field,
                                                   std::string_view meaning) {
  constexpr std::size_t longest = 80;
  for (const std::string& name : names) {
    const bool control = text::without_steering(name, false) != name;
    if (name.empty() || name.size() > longest || control) {
      return refusal(ArgumentError::malformed, where, "a name of " + std::string(field))
          .got(name.empty() ? "empty"
               : control    ? "not plain text"
                            : fmt::format("{} bytes long", name.size()))
          .expected(fmt::format("one line of at most {} bytes", longest));
    }
  }
  if (names.empty() || static_cast<Eigen::Index>(names.size()) == count) {
    std::vector<Coordinate> coordinates;
    for (const std::string& name : names) {
      coordinates.push_back(coordinate_from_label(name));
    }
    return coordinates;
  }
  return refusal(ArgumentError::wrong_shape, where, field)
      .got(fmt::format("{} names long", names.size()))
      .expected(fmt::format("{}, {} names", meaning, count));
}

/// What a model in JSON has.
std::span<const solve::Field> formula_fields() {
  namespace field = solve::field;
  static const std::vector<solve::Field> fields{
      field::A,
      field::B,
      field::C,
      field::D,
      solve::or_first(field::domain),
      solve::optional(solve::number("T", "s", "sample period")),
      solve::optional(solve::texts("states", "n", "names")),
      solve::optional(solve::texts("inputs", "m", "names")),
      solve::optional(solve::texts("outputs", "p", "names"))};
  return fields;
}

ExpectedAll<ModelFile> parse_matrices(std::string_view text, const std::string& name) {
  FLYBALL_TRY(const solve::JsonTree object, solve::parse_object(text, name, "model"));
  FLYBALL_TRY(const auto fields, solve::Problem::read(object.root(), formula_fields(), name));
  ModelFile model;
  model.path = name;
  model.system = fields.system();
  model.domain = fields.domain();
  if (fields.has("T")) {
    model.period = Time(fields.number("T"));
  }
  if (model.domain == TimeDomain::discrete && !model.period) {
    return refusal(ArgumentError::malformed, name, "T")
        .got("left out")
        .expected("the sample period of the discrete model in seconds");
  }
  const ContinuousSystem<>& system = model.system;
  FLYBALL_CHECK(Checks(name)
                    .also([&] { return check_system(system, name); })
                    .positive(model.period.value_or(Time(1.0)).si(), "T", "s"));
  FLYBALL_TRY(model.states, read_coordinates(fields.texts("states"), system.A.rows(), name,
                                             "states", "one for each row of A"));
  FLYBALL_TRY(model.inputs, read_coordinates(fields.texts("inputs"), system.B.cols(), name,
                                             "inputs", "one for each column of B"));
  FLYBALL_TRY(model.outputs, read_coordinates(fields.texts("outputs"), system.C.rows(), name,
                                              "outputs", "one for each row of C"));
  return model;
}

/// What friction and gravity do, no matrix says.
void note_what_is_left_out(const PlantDescription& plant, std::vector<Diagnostic>& notes) {
  const mechanisms::FeedforwardGains& gains = plant.gains;
  std::vector<std::string> left_out;
  if (gains.kS > 0.0) {
    left_out.push_back(fmt::format("static friction (kS = {} V)", format_number(gains.kS, 3)));
  }
  if (gains.kG != 0.0) {
    left_out.push_back(fmt::format("gravity (kG = {} V)", format_number(gains.kG, 3)));
  }
  if (!left_out.empty()) {
    note(notes, "left_out",
         "{} {} no part of a linear model; the feedforward of `flyball design` cancels {}",
         left_out.size() == 2 ? left_out[0] + " and " + left_out[1] : left_out[0],
         left_out.size() == 2 ? "are" : "is", left_out.size() == 2 ? "them" : "it");
  }
}

/// A file that is no text is named so, instead of a complaint about its first byte.
bool is_binary(std::string_view text) {
  const std::string_view head = text.substr(0, 4096);
  return std::any_of(head.begin(), head.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x09 || byte == 0xff || byte == 0xfe;  // the last two never stand in UTF-8
  });
}

bool is_json(std::string_view text, std::string_view name) {
  if (name.ends_with(".json") || name.ends_with(".toml")) {
    return name.ends_with(".json");
  }
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{';
}

}  // namespace

ExpectedAll<ModelFile> parse_model(std::string_view text, const std::string& name,
                                   std::span<const Override> overrides) {
  const bool blank = text.find_first_not_of(" \t\r\n") == std::string_view::npos;
  if (blank || is_binary(text)) {
    return tl::unexpected(Error(blank ? ArgumentError::empty : ArgumentError::malformed)
                              .in(name)
                              .about("the model")
                              .got(blank ? "empty" : "binary")
                              .expected("a JSON object with A and B, or a project file (TOML)"));
  }
  if (!is_json(text, name)) {
    return parse_project(text, name, overrides).and_then(&model_of);
  }
  if (!overrides.empty()) {
    return refusal(ArgumentError::unknown_name, {}, overrides.front().option)
        .got("given with matrices")
        .hint("it is for a project file");
  }
  return parse_matrices(text, name);
}

/// A model by formula about its point.
Expected<ModelFile> linearized(const ModelJob& job) {
  if (job.model.inputs() == 0) {
    return refusal(ArgumentError::empty, job.path, "model.inputs")
        .got("empty")
        .expected("at least one, such as push = \"N\", for a matrix B")
        .hint("`flyball simulate` runs the model as it is");
  }
  FLYBALL_TRY(auto point, operating_point(job));
  ModelFile model;
  FLYBALL_TRY(model.system, linearize(job.model, point.x, point.u));
  const ModelDescription& names = job.model.names();
  model.path = job.path;
  model.name = names.name;
  model.period = Time(job.period);
  model.states = names.states;
  model.inputs = names.inputs;
  model.outputs = names.outputs;
  if (!point.is_equilibrium) {
    warn(model.notes, "no_equilibrium", "the point is {}; the linear model leaves that motion out",
         describe(point, names));
  }
  model.point = std::move(point);
  return model;
}

ExpectedAll<ModelFile> model_of(const Project& project) {
  if (project.model_job) {
    return linearized(*project.model_job);
  }
  if (project.plant_error) {
    return tl::unexpected(*project.plant_error);
  }
  const PlantDescription& plant = project.job.plant;
  const double period = project.job.controller.period;
  FLYBALL_TRY(auto linear, linear_model(plant, period));
  ModelFile model;
  model.path = project.path;
  model.period = Time(period);
  model.states = linear.states;
  model.inputs = {{"voltage", "V"}};
  model.outputs = {model.states.front()};
  model.plant = plant;
  model.notes = plant.doubts;
  const DiscreteSystem<>& discrete = linear.discrete;
  if (plant.kA_determined || !controls_velocity(plant.kind)) {
    model.system = {linear.A, linear.B, linear.C, discrete.D};
  } else {
    // What happens within the period is not known.
    model.domain = TimeDomain::discrete;
    model.system = {discrete.A, discrete.B, discrete.C, discrete.D};
  }
  if (!plant.kA_determined) {
    model.notes.push_back(unknown_kA(plant));
  }
  note_what_is_left_out(plant, model.notes);
  return model;
}

ExpectedAll<ModelFile> read_model(const std::string& path, std::span<const Override> overrides) {
  const bool standard_input = path == "-";
  FLYBALL_TRY(const auto text, read_file(standard_input ? "/dev/stdin" : path, largest_model));
  return parse_model(text, standard_input ? "standard input" : path, overrides);
}

}  // namespace flyball::study
