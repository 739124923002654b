#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/study/design_model.hpp>
#include <flyball/study/project.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/norms.hpp>
#include <flyball/systems/response.hpp>
#include <flyball/systems/sampling.hpp>
#include <flyball/systems/structure.hpp>

namespace flyball::study {

/// A linear system as a person writes it down.
struct ModelFile {
  std::string path{};         ///< Where it comes from, for titles.
  ContinuousSystem<> system;  ///< A, B, C, D; of a discrete system its matrices too.
  TimeDomain domain = TimeDomain::continuous;
  /// T, s: of a discrete system; of a continuous one the period of the loop that will sample it, if
  /// it is known.
  std::optional<Time> period{};
  std::vector<Coordinate> states{};         ///< Or x1, x2, … where there are fewer.
  std::vector<Coordinate> inputs{};         ///< Or u1, u2, …
  std::vector<Coordinate> outputs{};        ///< Or a state's name, or y1, y2, …
  std::optional<PlantDescription> plant{};  ///< The mechanism, if the model is one's.
  std::optional<OperatingPoint> point{};    ///< Where a model by formula was linearised.
  std::string name{};                       ///< Of a model by formula.
  std::vector<Diagnostic> notes{};          ///< What the linear model leaves out.
};

/// A model from its text.
///
/// JSON, which begins with `{`: A and B, and where they are not left out C (identity), D (zero),
/// `domain` ("continuous"), `T` in seconds (which a discrete model must have; a continuous one is
/// also looked at as sampled), and the names `states`, `inputs` and `outputs`. All else is a
/// project file (TOML) of a mechanism: its linear model with the voltage as input, and the
/// controller's period as T.
/// @param name  What the text is called in messages; one that ends in .json or .toml decides.
/// @param overrides  Of a project file's values.
/// @errors ArgumentError for text that is no such object, unknown fields, shapes and entries;
///         ProjectError and those of `parse_project` for a project, also for one that does not say
///         what its mechanism is made of.
[[nodiscard]] ExpectedAll<ModelFile> parse_model(std::string_view text, const std::string& name,
                                                 std::span<const Override> overrides = {});

/// The model of a project's mechanism. @errors Project::plant_error; those of the mechanism.
[[nodiscard]] ExpectedAll<ModelFile> model_of(const Project& project);

/// Reads a model. @param path  "-" is standard input. @errors FileError, and as `parse_model`.
[[nodiscard]] ExpectedAll<ModelFile> read_model(const std::string& path,
                                                std::span<const Override> overrides = {});

/// A continuous system as a loop of a certain period meets it.
struct SampledAnalysis : StructureAnalysis {
  DiscretizedMatrices system;  ///< Zero-order hold.
  SamplingAnalysis sampling;
};

/// The outputs after a unit step of one input, from rest.
using StepResponse = LinearResponse;

/// From one input to one output, over frequency.
struct ChannelResponse {
  Eigen::Index input = 0;
  Eigen::Index output = 0;
  std::vector<FrequencyPoint> response{};
};

/// What a linear system is like.
struct ModelAnalysis : StructureAnalysis {
  ModelFile model;                         ///< With a name for every state, input and output.
  std::optional<SampledAnalysis> sampled;  ///< Of a continuous model with a period; nothing, and
                                           ///< a note, where a mode outgrows it.
  std::optional<Eigen::MatrixXd> dc_gain;  ///< outputs x inputs; nothing with an integrator.
  std::optional<double> h2_norm;           ///< Of a stable system without an infinite one.
  std::optional<HInfinityNorm> h_infinity_norm;  ///< Of a stable system.
  std::vector<StepResponse> steps;  ///< One an input, of the first 16; a growing one is shown for
                                    ///< a few of its time constants.
  /// Of the first channels that are not zero, about the modes' frequencies, of a discrete system up
  /// to Nyquist's; none of more than 40 states.
  std::vector<ChannelResponse> frequency_responses{};
};

/// Poles, controllability and observability, gains and step responses of a model.
/// @errors ArgumentError for the system and for a discrete one without a period; those of
///         analyze_structure; that of the step responses' discretisation. With the model's notes.
[[nodiscard]] ExpectedAll<ModelAnalysis> analyze(const ModelFile& model);

}  // namespace flyball::study
