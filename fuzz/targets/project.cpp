#include <flyball/study/project.hpp>

#include "targets/require.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flyball;
  const auto project = study::parse_project(fuzz::text_of(data, size), "fuzz.toml");
  if (project) {
    const std::string text = study::write_project(*project);
    fuzz::require(study::parse_project(text, "again.toml").has_value(),
                  "a project that was written can be read");
  }
  return 0;
}
