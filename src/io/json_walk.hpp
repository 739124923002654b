#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <unordered_set>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

/// JSON without a tree, for texts whose bytes are numbers.
///
/// nlohmann's SAX parser copies each number to a buffer and calls strtod; here numbers are read
/// where they stand, by `std::from_chars`. Strings with escapes or beyond ASCII are taken apart by
/// nlohmann's parser, so that both agree about what is JSON.
namespace flyball::io {

enum class JsonEnd {
  complete,
  cut,      ///< The text ends before the value does.
  broken,   ///< No JSON, a number beyond double, or an object with a key twice.
  stopped,  ///< The handler wanted no more.
};

/// A text that is all there. `ChunkedFile` is the other source.
class WholeText {
 public:
  explicit WholeText(std::string_view text) : text_(text) {}
  [[nodiscard]] std::string_view rest() const noexcept { return text_; }
  void pass(std::size_t bytes) noexcept { text_.remove_prefix(bytes); }
  static bool more() noexcept { return false; }

 private:
  std::string_view text_;
};

/// Walks through one JSON value and calls what `nlohmann::json_sax` has, all numbers as
/// `number_float`, `parse_error` excepted. Depth is bounded by memory only. O(bytes).
template <class Source, class Handler>
class JsonWalk {
 public:
  JsonWalk(Source& source, Handler& handler) : source_(source), handler_(handler) {
    open_.reserve(8);
    keys_.reserve(8);
    look();
  }

  /// On return the source has passed all but what was not understood.
  JsonEnd walk() {
    const JsonEnd end = value_and_rest();
    source_.pass(passed());
    return end;
  }

 private:
  enum class Expect { value, value_or_end, key, key_or_end, comma_or_end };

  struct Open {
    bool object = false;
    std::size_t first_key = 0;  ///< Of keys_.
    std::unique_ptr<std::unordered_set<std::string>> more_keys{};
  };

  [[nodiscard]] std::size_t passed() const {
    return static_cast<std::size_t>(at_ - source_.rest().data());
  }
  void look() {
    at_ = source_.rest().data();
    end_ = at_ + source_.rest().size();
  }
  /// Reads on; what stands from `at_` stays.
  bool more() {
    source_.pass(passed());
    const bool any = source_.more();
    look();
    return any;
  }
  bool skip_blanks() {
    for (;;) {
      while (at_ != end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\r' || *at_ == '\t')) {
        ++at_;
      }
      if (at_ != end_) {
        return true;
      }
      if (!more()) {
        return false;
      }
    }
  }

  JsonEnd value_and_rest() {
    for (;;) {
      if (!skip_blanks()) {
        return JsonEnd::cut;
      }
      const JsonEnd step = take();
      if (step != JsonEnd::complete) {
        return step;
      }
      if (open_.empty()) {
        return skip_blanks() ? JsonEnd::broken : JsonEnd::complete;
      }
    }
  }

  /// One token. @return complete: go on.
  JsonEnd take() {
    const char c = *at_;
    if (expect_ == Expect::comma_or_end) {
      if (c == ',') {
        ++at_;
        expect_ = open_.back().object ? Expect::key : Expect::value;
        return JsonEnd::complete;
      }
      return close(c);
    }
    if (expect_ == Expect::key || expect_ == Expect::key_or_end) {
      return c == '"' ? key() : expect_ == Expect::key_or_end ? close(c) : JsonEnd::broken;
    }
    if (c == '-' || (c >= '0' && c <= '9')) {
      return number();
    }
    switch (c) {
      case '{':
      case '[':
        ++at_;
        open_.push_back({c == '{', keys_.size(), nullptr});
        expect_ = c == '{' ? Expect::key_or_end : Expect::value_or_end;
        return go_on_if(c == '{' ? handler_.Handler::start_object(none)
                                 : handler_.Handler::start_array(none));
      case ']':
        return expect_ == Expect::value_or_end ? close(c) : JsonEnd::broken;
      case '"': {
        std::string text;
        const JsonEnd read = string(text);
        return read == JsonEnd::complete ? after(handler_.Handler::string(text)) : read;
      }
      case 't':
        return word("true", [&] { return handler_.Handler::boolean(true); });
      case 'f':
        return word("false", [&] { return handler_.Handler::boolean(false); });
      case 'n':
        return word("null", [&] { return handler_.Handler::null(); });
      default:
        return JsonEnd::broken;
    }
  }

  static JsonEnd go_on_if(bool wanted) { return wanted ? JsonEnd::complete : JsonEnd::stopped; }
  JsonEnd after(bool wanted) {
    expect_ = Expect::comma_or_end;
    return go_on_if(wanted);
  }

  JsonEnd close(char c) {
    if (c != (open_.back().object ? '}' : ']')) {
      return JsonEnd::broken;
    }
    ++at_;
    const bool object = open_.back().object;
    keys_.resize(open_.back().first_key);
    open_.pop_back();
    return after(object ? handler_.Handler::end_object() : handler_.Handler::end_array());
  }

  template <class Said>
  JsonEnd word(std::string_view text, Said said) {
    while (static_cast<std::size_t>(end_ - at_) < text.size()) {
      if (!text.starts_with(std::string_view(at_, static_cast<std::size_t>(end_ - at_)))) {
        return JsonEnd::broken;
      }
      if (!more()) {
        return JsonEnd::cut;
      }
    }
    if (std::string_view(at_, text.size()) != text) {
      return JsonEnd::broken;
    }
    at_ += text.size();
    return after(said());
  }

  static bool is_digit(char c) { return c >= '0' && c <= '9'; }

  /// Where a number that begins at `at` stops being one: its end, or where it is wrong.
  static const char* number_end(const char* at, const char* end) {
    const auto digits = [&] {
      const char* begin = at;
      while (at != end && is_digit(*at)) {
        ++at;
      }
      return at != begin;
    };
    at += *at == '-' ? 1 : 0;
    const char* first = at;
    if (!digits() || (*first == '0' && at - first > 1)) {
      return nullptr;
    }
    if (at != end && *at == '.') {
      ++at;
      if (!digits()) {
        return nullptr;
      }
    }
    if (at != end && (*at == 'e' || *at == 'E')) {
      ++at;
      at += at != end && (*at == '-' || *at == '+') ? 1 : 0;
      if (!digits()) {
        return nullptr;
      }
    }
    return at;
  }

  JsonEnd number() {
    const char* stop = number_end(at_, end_);
    while (stop == end_ || (stop == nullptr && rest_is_numeric())) {  // it may go on
      if (end_ - at_ > longest_number) {  // which would be read anew with each chunk
        return JsonEnd::broken;
      }
      const bool ended = !more();
      if (ended && (stop == nullptr || !open_.empty())) {
        return JsonEnd::cut;
      }
      stop = number_end(at_, end_);
      if (ended) {
        break;
      }
    }
    if (stop == nullptr) {
      return JsonEnd::broken;
    }
    double value = 0.0;
    const auto [read, error] = std::from_chars(at_, stop, value);
    if (error == std::errc::result_out_of_range) {
      // Both too large and too small; nlohmann's parser tells them apart.
      const auto parsed = nlohmann::json::parse(at_, stop, nullptr, false);
      if (!parsed.is_number()) {
        return JsonEnd::broken;
      }
      value = parsed.template get<double>();
    }
    at_ = stop;
    static const std::string no_text;
    return after(handler_.Handler::number_float(value, no_text));
  }
  [[nodiscard]] bool rest_is_numeric() const {
    return std::all_of(at_, end_, [](char c) {
      return is_digit(c) || c == '-' || c == '+' || c == '.' || c == 'e' || c == 'E';
    });
  }

  JsonEnd string(std::string& text) {
    std::size_t size = 1;
    bool plain = true;
    for (;; ++size) {
      if (at_ + size >= end_ && !more()) {
        return JsonEnd::cut;
      }
      const auto c = static_cast<unsigned char>(at_[size]);
      if (c == '"') {
        break;
      }
      if (c < 0x20) {
        return JsonEnd::broken;
      }
      plain = plain && c < 0x80 && c != '\\';
      if (c == '\\' && at_ + ++size >= end_ && !more()) {
        return JsonEnd::cut;
      }
    }
    if (plain) {
      text.assign(at_ + 1, size - 1);
    } else {
      auto parsed = nlohmann::json::parse(at_, at_ + size + 1, nullptr, false);
      if (!parsed.is_string()) {
        return JsonEnd::broken;
      }
      text = std::move(parsed.template get_ref<std::string&>());
    }
    at_ += size + 1;
    return JsonEnd::complete;
  }

  JsonEnd key() {
    std::string name;
    if (const JsonEnd read = string(name); read != JsonEnd::complete) {
      return read;
    }
    if (!skip_blanks()) {
      return JsonEnd::cut;
    }
    if (*at_ != ':' || !is_new(name)) {
      return JsonEnd::broken;
    }
    ++at_;
    expect_ = Expect::value;
    return go_on_if(handler_.Handler::key(name));
  }

  /// Whether the object that is open has no such key; it has from now on.
  bool is_new(const std::string& name) {
    constexpr std::size_t few = 16;
    Open& object = open_.back();
    const auto begin = keys_.begin() + static_cast<std::ptrdiff_t>(object.first_key);
    if (std::find(begin, keys_.end(), name) != keys_.end()) {
      return false;
    }
    if (keys_.size() - object.first_key == few) {
      if (!object.more_keys) {
        object.more_keys = std::make_unique<std::unordered_set<std::string>>();
      }
      return object.more_keys->insert(name).second;
    }
    keys_.push_back(name);
    return true;
  }

  static constexpr std::size_t none = static_cast<std::size_t>(-1);
  static constexpr std::ptrdiff_t longest_number = 4096;  ///< At the end of a chunk.

  Source& source_;
  Handler& handler_;
  const char* at_ = nullptr;
  const char* end_ = nullptr;
  Expect expect_ = Expect::value;
  std::vector<Open> open_;
  std::vector<std::string> keys_;  ///< The first of each object that is open.
};

}  // namespace flyball::io
