#include <cstdint>
#include <string>

#include <rapidcheck.h>

#include "support/property.hpp"

namespace flyball::test {

bool holds_for_random(const char* name, const std::function<void(Random&)>& law) {
  return rc::check(name, [&] {
    Random random(*rc::gen::arbitrary<std::uint64_t>());
    law(random);
  });
}

void require(bool is_true, std::source_location at) {
  if (!is_true) {
    RC_FAIL(std::string(at.file_name()) + ":" + std::to_string(at.line()));
  }
}

}  // namespace flyball::test
