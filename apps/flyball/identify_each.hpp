#pragma once

#include <functional>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include <flyball/study/identify_each.hpp>

#include "console.hpp"
#include "job_command.hpp"

/// `flyball identify` of many logs, each by itself.
namespace flyball::app {

struct EachOptions {
  bool each = false;
  std::string shard{};  ///< "2/8"
  // 0 where nobody said.
  std::size_t jobs = 0;
  double log_seconds = 0.0;  ///< Of processor time.
  std::size_t log_megabytes = 0;
};

/// Adds --each, --jobs, --shard, --log-time and --log-memory.
void add_each_options(CLI::App& command, const std::shared_ptr<EachOptions>& options);

/// Whether a folder or an option asks for logs one by one.
[[nodiscard]] bool means_each(const JobInput& input, const EachOptions& options);

/// Does it. @return The exit status.
[[nodiscard]] int identify_each(JobInput& input, const EachOptions& options,
                                const CommonOptions& common);

/// Writes rows into --out, and prints them. @param written  Called between the two.
/// @return The exit status.
[[nodiscard]] int tell_rows(const study::LogRows& rows, std::size_t passed_over,
                            const CommonOptions& common, const std::function<void()>& written = {});

}  // namespace flyball::app
