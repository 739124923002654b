#include <flyball/io/log.hpp>

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/wpilog.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "io/text.hpp"

namespace flyball {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view what_is_read = "a SysId JSON, a WPILOG or a CSV";

/// Files that people hold for a log, told by their first bytes.
struct Signature {
  std::string_view bytes;
  std::string_view name;
  std::string_view hint;
};
constexpr std::array signatures = {
    Signature{"\x89MCAP0\r\n"sv, "an MCAP recording", "export it as CSV or WPILOG"},
    Signature{"\x1F\x8B"sv, "a gzip archive", "unpack it first"},
    Signature{"PK\x03\x04"sv, "a zip archive or a spreadsheet",
              "unpack it, or save the sheet as CSV"},
    Signature{"\xFF\xFE"sv, "UTF-16 text", "save it as UTF-8"},
    Signature{"\xFE\xFF"sv, "UTF-16 text", "save it as UTF-8"},
    Signature{"%PDF"sv, "a PDF", "give the log itself"},
    Signature{"\x89PNG"sv, "a picture", "give the log itself"},
};

/// Whether the first bytes hold a control character that no text has.
bool looks_binary(std::string_view bytes) {
  const std::string_view head = bytes.substr(0, 4096);
  return std::any_of(head.begin(), head.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 && byte != '\t' && byte != '\n' && byte != '\r' && byte != '\f' &&
           byte != 0x1A;
  });
}

Refusal not_a_log(const std::string& source, std::string got, std::string hint) {
  return refusal(LogError::not_a_log, source, "the file")
      .got(std::move(got))
      .expected(std::string(what_is_read))
      .hint(std::move(hint));
}

}  // namespace

ErrorInfo error_info(LogError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"empty", "the file is empty", ErrorKind::misuse},
      {"not_a_log", "the file is not a log that Flyball reads", ErrorKind::misuse},
      {"wrong_magic", "the file does not begin as a WPILOG", ErrorKind::misuse},
      {"wrong_version", "the WPILOG has an unknown version", ErrorKind::misuse},
      {"malformed", "the log breaks the rules of its format", ErrorKind::misuse},
      {"no_data", "the log holds no usable sample", ErrorKind::misuse},
      {"no_time", "the table has no column of time", ErrorKind::misuse},
  };
  return detail::info_of(code, "log", rows);
}

const Signal* Log::find_signal(std::string_view name) const noexcept {
  const auto found = std::find_if(signals.begin(), signals.end(),
                                  [&](const Signal& signal) { return signal.name == name; });
  return found == signals.end() ? nullptr : &*found;
}

const TextSignal* Log::find_text(std::string_view name) const noexcept {
  const auto found = std::find_if(texts.begin(), texts.end(),
                                  [&](const TextSignal& text) { return text.name == name; });
  return found == texts.end() ? nullptr : &*found;
}

Expected<Log> parse_log(std::string_view bytes, const std::string& source) {
  if (bytes.empty()) {
    return refusal(LogError::empty, source, "the file")
        .got("empty")
        .expected(std::string(what_is_read))
        .hint("record it again, or copy it again from the robot");
  }
  const bool named_wpilog = io::lower(source).ends_with(".wpilog");
  if (bytes.starts_with("WPILOG") || named_wpilog) {
    return parse_wpilog(bytes, source);
  }
  for (const Signature& signature : signatures) {
    if (bytes.starts_with(signature.bytes)) {
      return not_a_log(source, std::string(signature.name), std::string(signature.hint));
    }
  }
  std::string_view text = bytes;
  if (text.starts_with("\xEF\xBB\xBF")) {
    text.remove_prefix(3);
  }
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string_view::npos && (text[first] == '{' || text[first] == '[')) {
    FLYBALL_TRY(SysIdJson sysid, parse_sysid_json(bytes, source));
    Log log;
    log.source = source;
    log.format = "SysId JSON";
    log.diagnostics = sysid.diagnostics;
    log.sysid = std::move(sysid);
    return log;
  }
  if (looks_binary(bytes)) {
    return not_a_log(
        source, fmt::format("binary and begins with \"{}\"", io::printable(bytes.substr(0, 8))),
        "CTRE .hoot and driver-station logs have to be converted to WPILOG first");
  }
  if (io::lower(source).ends_with(".json")) {
    return not_a_log(
        source, fmt::format("text that begins with \"{}\"", io::printable(bytes.substr(0, 20), 20)),
        "a SysId JSON begins with {");
  }
  return parse_csv(bytes, source);
}

Expected<Log> read_log(const std::string& path) {
  auto bytes = read_file(path);
  if (!bytes && bytes.error().is(FileError::too_large)) {
    return tl::unexpected(std::move(bytes).error().hint(
        "cut out the part with the tests, for example with AdvantageScope"));
  }
  return bytes.and_then([&](const std::string& read) { return parse_log(read, path); });
}

}  // namespace flyball
