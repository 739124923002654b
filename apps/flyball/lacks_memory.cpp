#include <new>
#include <system_error>

#include "lacks_memory.hpp"

namespace flyball::app {

bool lacks_memory(const std::exception& problem) noexcept {
  if (dynamic_cast<const std::bad_alloc*>(&problem) != nullptr) {
    return true;
  }
  // A thread that cannot be started throws "resource unavailable, try again".
  const auto* const system = dynamic_cast<const std::system_error*>(&problem);
  return system != nullptr && (system->code() == std::errc::resource_unavailable_try_again ||
                               system->code() == std::errc::not_enough_memory);
}

}  // namespace flyball::app
