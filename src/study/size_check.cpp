// What in [size] would be silently without effect, or cannot be.
#include <fmt/format.h>

#include <flyball/study/project.hpp>

#include "study/size_fields.hpp"
#include "study/toml_document.hpp"

namespace flyball::study {

using mechanisms::MechanismKind;

void check_size(TomlDocument& document, const Project& project) {
  const SizeSection& said = project.size;
  const MechanismKind kind = *project.parts.type;
  const bool drives = kind == MechanismKind::swerve_drive;
  const std::string of(to_string(kind));
  using Fault = TomlDocument::Fault;
  const auto refuse = [&](std::string_view key, std::string got, std::string hint,
                          Fault fault = Fault::key) {
    if (document.has("size", key)) {
      document.refuse("size", key,
                      Error(ProjectError::wrong_value)
                          .about(document.name("size", key))
                          .got(std::move(got))
                          .hint(std::move(hint)),
                      fault);
    }
  };
  if (!drives && said.distance) {
    refuse("distance", fmt::format("without meaning for this {}", of),
           "say where its motion begins and ends: start and end");
  }
  if (!drives && said.grip) {
    refuse("grip", fmt::format("without meaning for this {}", of), "it is of wheels on a floor");
  }
  if (said.distance && (said.start || said.end)) {
    refuse("distance", "beside a start or an end, which are speeds",
           "ask for a distance or for a speed, not for both");
  }
  if (said.stop && !said.distance) {
    refuse("stop", "without a distance",
           drives ? "say size.distance" : "this motion ends at rest, or at its speed");
  }
  if (!said.locked_rotor.empty() && said.winding_heat_capacity) {
    refuse("locked_rotor", "beside winding_heat_capacity", "say one of them");
  }
  if (said.winding_thermal_resistance && !said.winding_heat_capacity && said.locked_rotor.empty()) {
    refuse("winding_thermal_resistance", "without a heat capacity",
           "say winding_heat_capacity, in J/K, or locked_rotor, a file of flyball motor-curves");
  }
  if (!(said.efficiency <= 1.0)) {
    refuse("efficiency", format_number(said.efficiency), "90 % is 0.9; gears lose power",
           Fault::value);
  }
  // A gram of copper takes 0.4 J/K; the largest motors have some kilograms.
  constexpr double least = 0.1;
  constexpr double most = 1e5;
  if (said.winding_heat_capacity &&
      !(*said.winding_heat_capacity >= least && *said.winding_heat_capacity <= most)) {
    refuse("winding_heat_capacity",
           fmt::format("{} J/K", format_number(*said.winding_heat_capacity)),
           "of one motor's windings it is 0.385 J/K for each gram of copper: some 20 to 200 J/K",
           Fault::value);
  }
}

}  // namespace flyball::study
