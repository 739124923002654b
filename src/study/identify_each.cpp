#include <flyball/study/identify_each.hpp>

#include <filesystem>
#include <fstream>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/version.hpp>
#include <flyball/io/checksum.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/log.hpp>
#include <flyball/recording/stream_recording.hpp>

#include "core/error_rows.hpp"
#include "study/answer/parts.hpp"
#include "study/identify_with.hpp"

namespace flyball::study {

namespace {

int status_of(const Error& error) {
  return error.kind() == ErrorKind::no_answer ? 1 : 2;
}

std::string digits(std::uint64_t sum) {
  return fmt::format("{:016x}", sum);
}

/// Of a file of any size; empty if it cannot be read.
std::string checksum_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<char> chunk(std::size_t{1} << 18);
  std::uint64_t sum = checksum("");
  while (file) {
    file.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    sum = checksum({chunk.data(), static_cast<std::size_t>(file.gcount())}, sum);
  }
  return file.eof() ? digits(sum) : std::string();
}

/// Bytes of a regular file.
std::optional<std::uint64_t> size_of_file(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? std::nullopt : std::optional<std::uint64_t>(size);
}

/// The object that `write` fills, without its braces.
template <class Write>
std::string members(const Write& write) {
  JsonWriter json;
  json.object([&] { write(json); });
  const std::string& text = json.text();
  return text.substr(1, text.size() - 2);
}

void write_head(JsonWriter& json, const LogRow& row, std::string_view verdict,
                const std::string& words) {
  json.add("path", row.path);
  json.add("size", row.size);
  json.add("checksum", row.checksum);
  json.add("settings", row.settings);
  json.add("status", row.status);
  json.add("lasting", row.lasting);
  json.add("verdict", verdict);
  json.add("words", words);
}

void refuse(LogRow& row, const Errors& errors) {
  row.status = status_of(errors);
  row.members = members([&](JsonWriter& json) {
    write_head(json, row, "bad", to_string(errors));
    json.add("error", errors.all().front());
    if (const auto all = errors.all(); all.size() > 1) {
      json.list("errors", all, [&](const QuotedError& error) { json.write(error); });
    }
    json.add("diagnostics", errors.diagnostics());
  });
}

std::string_view word_of(Tone tone) {
  return tone == Tone::good ? "good" : tone == Tone::caution ? "caution" : "bad";
}

std::size_t rows_of(const recording::LoadedRecording& source) {
  std::size_t rows = 0;
  for (const auto& run : source.recording.runs) {
    rows += run.time.size();
  }
  if (source.drive) {
    for (const auto& run : source.drive->runs) {
      rows += run.time.size();
    }
  }
  return rows;
}

void tell(LogRow& row, const IdentifyResult& result) {
  const Verdict verdict = verdict_of(result);
  const bool drive = result.drive && result.drive->fit;
  const Error* error = nullptr;
  if (result.drive && !result.drive->fit) {
    error = &result.drive->fit.error();
  } else if (!drive && !result.report.fit) {
    error = &result.report.fit.error();
  }
  row.status = error == nullptr ? 0 : status_of(*error);
  row.members = members([&](JsonWriter& json) {
    write_head(json, row, word_of(verdict.tone),
               error == nullptr ? verdict.line : to_string(*error));
    json.add("format", result.source.format);
    json.add("rows", rows_of(result.source));
    if (error != nullptr) {
      json.add("error", *error);
    } else if (drive) {
      write_drive(json, result);
    } else {
      const identification::FeedforwardFit& fit = *result.report.fit;
      json.add("mechanism", to_string(fit.mechanism));
      json.add("unit", fit.unit);
      write_gains(json, fit);
      write_terms(json, fit);
      json.object("fit", [&] { write_quality(json, fit); });
    }
    json.add("diagnostics", result.diagnostics());
  });
}

ExpectedAll<IdentifyResult> identify_bytes(std::string bytes, const IdentifyJob& job) {
  if (!job.selection.also.empty()) {
    return identify(job);
  }
  auto log = parse_log(bytes, job.log);
  if (!log) {
    return tl::unexpected(Errors(std::move(log).error()));
  }
  std::string().swap(bytes);
  auto result = identify(*log, job.selection);
  if (result) {
    tell_contradictions(result->report, job.said);
  }
  return result;
}

}  // namespace

ErrorInfo error_info(LogRowsError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"took_too_long", "the log took more time than a log may take", ErrorKind::environment},
      {"took_too_much_memory", "the log took more memory than a log may take",
       ErrorKind::environment},
      {"ended_early", "the process that had the log ended without an answer", ErrorKind::defect},
      {"not_rows", "the file is not one of rows of logs", ErrorKind::misuse},
      {"rows_differ", "the rows are not of one whole", ErrorKind::misuse},
      {"rows_missing", "parts are missing", ErrorKind::misuse},
  };
  return flyball::detail::info_of(code, "log_rows", rows);
}

std::string settings_of(const IdentifyJob& job) {
  const recording::LogSelection& s = job.selection;
  const PlantDescription& said = job.said;
  const mechanisms::FeedforwardGains& gains = said.gains;
  return digits(checksum(fmt::format(
      "{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{} {} {} {} {} {} {} {}",
      version, s.mechanism ? to_string(*s.mechanism) : std::string_view(), s.drivetrain,
      s.state_channel, s.voltage_channel, s.position_channel, s.velocity_channel, s.heading_channel,
      s.also, s.unit, s.velocity_unit, s.no_velocity, s.scale, s.voltage_scale,
      fmt::join(s.runs, ","), fmt::join(s.without_runs, ","), to_string(said.kind), gains.kV,
      gains.kA, gains.kG, said.kA_determined, said.motor ? said.motor->name : std::string(),
      said.gearing, said.drum_radius)));
}

LogRow identify_row(const IdentifyJob& job) {
  const std::string& path = job.log;
  LogRow row;
  row.path = path;
  row.settings = settings_of(job);
  const auto finish = [&](const ExpectedAll<IdentifyResult>& result) {
    if (!result) {
      refuse(row, result.error());
    } else {
      tell(row, *result);
    }
    return row;
  };
  if (const auto size = size_of_file(path); size && *size >= recording::streamed_from) {
    row.size = *size;
    row.checksum = checksum_of_file(path);
    return finish(identify(job));
  }
  auto bytes = read_file(path);
  if (!bytes) {
    refuse(row, Errors(std::move(bytes).error()));
    return row;
  }
  row.size = bytes->size();
  row.checksum = digits(checksum(*bytes));
  return finish(identify_bytes(*std::move(bytes), job));
}

LogRow refused_row(const IdentifyJob& job, const Error& reason) {
  LogRow row;
  row.path = job.log;
  row.settings = settings_of(job);
  row.lasting = false;
  refuse(row, Errors(reason));
  return row;
}

bool still_holds(const LogRow& row, const IdentifyJob& job) {
  if (!row.lasting || row.checksum.empty() || row.settings != settings_of(job)) {
    return false;
  }
  return size_of_file(row.path) == row.size && checksum_of_file(row.path) == row.checksum;
}

}  // namespace flyball::study
