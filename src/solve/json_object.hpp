#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include <flyball/core/expected.hpp>

namespace flyball::solve {

/// The JSON object that a text is.
/// @param where  The kind of problem or the file, for messages. @param what  "problem" or "model".
/// @errors ArgumentError::malformed: no JSON, with the place; no object; nesting that no problem
/// has. Throws std::bad_alloc before it reads what it has not the memory for.
[[nodiscard]] Expected<nlohmann::json> parse_object(std::string_view text, std::string_view where,
                                                    std::string_view what);

/// Takes a value apart when it goes out of scope. Its own destructor would ask for memory to do so,
/// and end the process if there is none.
class TakenApart {
 public:
  explicit TakenApart(nlohmann::json& value) : value_(value) {}
  TakenApart(const TakenApart&) = delete;
  TakenApart& operator=(const TakenApart&) = delete;
  ~TakenApart() { clear(value_); }

 private:
  static void clear(nlohmann::json& value) noexcept;

  nlohmann::json& value_;
};

}  // namespace flyball::solve
