#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/systems/controllability.hpp>
#include <flyball/systems/norms.hpp>

namespace flyball::study {

/// A linear system as a person writes it down.
struct ModelFile {
  ContinuousSystem<> system;  ///< A, B, C, D; of a discrete system its matrices too.
  TimeDomain domain = TimeDomain::continuous;
  Time period{1.0};                 ///< T, s, of a discrete system.
  std::vector<std::string> states;  ///< Names; x1, x2, … where there are none.
};

/// A model from JSON text: A and B, and where they are not left out C (identity), D (zero),
/// `domain` ("continuous"), `T` in seconds (which a discrete model must have) and the names
/// `states`.
/// @param name  What the text is called in messages.
/// @errors ArgumentError for text that is not such an object, unknown fields, shapes and entries.
[[nodiscard]] Expected<ModelFile> parse_model(std::string_view text, const std::string& name);

/// The outputs after a unit step of one input, from rest.
struct StepResponse {
  Eigen::VectorXd time;  ///< s.
  Eigen::MatrixXd y;     ///< samples x outputs.
};

/// What a linear system is like.
struct ModelAnalysis {
  ModelFile model;
  ModalAnalysis modes;
  ControllabilityAnalysis controllability;
  ObservabilityAnalysis observability;
  std::optional<Eigen::MatrixXd> dc_gain;  ///< outputs x inputs; nothing with an integrator.
  std::optional<double> h2_norm;           ///< Of a stable system without an infinite one.
  std::optional<HInfinityNorm> h_infinity_norm;
  std::vector<StepResponse> steps;  ///< One an input.
};

/// Poles, controllability and observability, gains and step responses of a model.
/// @errors Those of analyze_modes, analyze_controllability and analyze_observability.
[[nodiscard]] Expected<ModelAnalysis> analyze(const ModelFile& model);

}  // namespace flyball::study
