#pragma once

#include "study/toml_document.hpp"

namespace flyball::study {

/// What a file with [model] describes. What is wrong with it is kept by the document; nothing then.
/// @param project  As read, section by section.
[[nodiscard]] std::optional<ModelJob> model_job(TomlDocument& document, const Project& project);

/// What [simulation] says of a mechanism: its states are position and velocity, its input is
/// voltage.
[[nodiscard]] ModelRun mechanism_run(TomlDocument& document, const Project& project);

}  // namespace flyball::study
