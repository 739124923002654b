#pragma once

#include <string>
#include <vector>

#include <flyball/io/motion/json_origin.hpp>

namespace flyball {

/// A value that Flyball takes as it stands.
struct JsonText {
  std::string text{};  ///< JSON; empty: absent.
};

/// A number, in Choreo's files with the expression that a person typed: {"exp": "11 in", "val":
/// 0.2794}. A changed value is written with its own expression.
struct ExpressedNumber {
  double value = 0.0;        ///< SI.
  std::string expression{};  ///< "11 in"; empty: a bare number.
  JsonOrigin origin{};
};

/// A number of a list that is known by names.
struct NamedNumber {
  std::string name{};
  ExpressedNumber number{};
};

/// A command of an autonomous routine, as PathPlanner and Choreo write them: {"type": "sequential",
/// "data": {"commands": […]}}.
struct AutoCommand {
  std::string type{};                   ///< "path", "named", "wait", "sequential", "parallel",
                                        ///< "race", "deadline", or another, kept.
  std::string name{};                   ///< Of a named command, or of a path.
  ExpressedNumber wait{};               ///< s, of a "wait".
  std::vector<AutoCommand> commands{};  ///< Of a group.
  JsonOrigin origin{};
};

}  // namespace flyball
