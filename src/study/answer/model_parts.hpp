#pragma once

#include <flyball/study/simulate.hpp>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

/// The point's coordinates with their units, and whether it is an equilibrium.
[[nodiscard]] Section point_section(const OperatingPoint& point, const ModelDescription& model);
/// The same as a member "point".
void write_point(JsonWriter& json, const OperatingPoint& point);

/// How it went: a table of the signals.
[[nodiscard]] Section simulation_section(const Simulation& result);
/// States, inputs and outputs over time, in that section.
[[nodiscard]] std::vector<Figure> figures_of(const Simulation& result);
[[nodiscard]] AnswerFile data_file(const Simulation& result);
/// From where the regulator is proven to hold, and the swing-up: sections, pictures, what is pasted
/// into a robot's code, and the members "region" and "swing_up".
void append_region(const ModelDesign& result, Answer& answer);
void write_region(JsonWriter& json, const ModelDesign& result);

/// The members of "flyball.simulate/1", without the schema and the diagnostics.
void write_simulation(JsonWriter& json, const Simulation& result);

}  // namespace flyball::study
