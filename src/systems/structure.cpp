#include <flyball/systems/structure.hpp>

#include <utility>

#include "core/try.hpp"

namespace flyball {

Expected<StructureAnalysis> analyze_structure(const ContinuousSystem<>& system, TimeDomain domain,
                                              Time period) {
  FLYBALL_CHECK(check_system(system, "analyze"));
  FLYBALL_TRY(auto modes, analyze_modes(system.A, domain, period));
  FLYBALL_TRY(auto controllability, analyze_controllability(system.A, system.B, domain));
  return analyze_observability(system.A, system.C, domain)
      .map([&](ObservabilityAnalysis&& observability) {
        return StructureAnalysis{std::move(modes), std::move(controllability),
                                 std::move(observability)};
      });
}

}  // namespace flyball
