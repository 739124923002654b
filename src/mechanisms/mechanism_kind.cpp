#include <flyball/mechanisms/mechanism_kind.hpp>

#include <algorithm>
#include <cctype>
#include <string>

#include "core/try.hpp"

namespace flyball::mechanisms {

std::string_view to_string(MechanismKind kind) {
  switch (kind) {
    case MechanismKind::flywheel:
      return "flywheel";
    case MechanismKind::elevator:
      return "elevator";
    case MechanismKind::arm:
      return "arm";
  }
  return "";
}

Expected<MechanismKind> parse_mechanism_kind(std::string_view text) {
  std::string folded;
  std::copy_if(text.begin(), text.end(), std::back_inserter(folded),
               [](unsigned char c) { return std::isalpha(c) != 0; });
  std::transform(folded.begin(), folded.end(), folded.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (folded == "flywheel" || folded == "simple") {
    return MechanismKind::flywheel;
  }
  if (folded == "elevator") {
    return MechanismKind::elevator;
  }
  if (folded == "arm" || folded == "singlejointedarm") {
    return MechanismKind::arm;
  }
  return refusal(ArgumentError::unknown_name, {}, "mechanism")
      .got("\"" + std::string(text) + "\"")
      .expected("flywheel, elevator or arm");
}

std::string_view position_unit(MechanismKind kind) {
  return kind == MechanismKind::elevator ? "m" : "rad";
}

}  // namespace flyball::mechanisms
