#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <flyball/planning/configuration/configuration_space.hpp>
#include <flyball/study/plan.hpp>

#include "study/table_reader.hpp"

namespace flyball::study {

/// The axes and regions of a configuration space.
class SpaceReader : public TableReader {
 protected:
  using TableReader::TableReader;

  static Dimension dimension_of(std::string_view unit);
  /// An [[axis]]; its limits are kept beside it.
  SpaceAxis axis(const toml::table& table);
  /// The number of an axis of this name; refused where there is none, at `key`.
  int axis_index(const toml::table& table, std::string_view key, std::string_view name);
  /// @param named  A [[region]], which has a name and a rule; else a part of one.
  std::optional<Region> region(const toml::table& table, bool named);
  /// A [[region]], for `regions_`. @param space  Of which it is to be one; null: not judged.
  void add_region(const ConfigurationSpace* space, const toml::table& table);

  std::vector<SpaceAxis> axes_{};
  std::vector<ConfigurationSpace::NamedRegion> regions_{};
  std::vector<MotionLimits> limits_{};
  std::vector<double> errors_of_axes_{};
  bool has_limits_ = true;
};

}  // namespace flyball::study
