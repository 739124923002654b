#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/progress.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/log_files.hpp>
#include <flyball/report/terminal.hpp>
#include <flyball/report/write_report.hpp>

#include "identify_each.hpp"
#include "processes.hpp"

namespace flyball::app {

namespace {

namespace fs = std::filesystem;

using study::LogRow;
using study::LogRows;
using study::NumberedRow;

constexpr const char* identify_each_schema = "flyball.identify_each/1";

/// All logs that the arguments name, sorted, each once.
Expected<LogFiles> logs_of(const JobInput& input, const std::string& out) {
  LogFiles all;
  std::vector<std::string> paths{input.path};
  paths.insert(paths.end(), input.more.begin(), input.more.end());
  for (const std::string& path : paths) {
    std::error_code ignored;
    if (!fs::is_directory(path, ignored)) {
      all.paths.push_back(path);
      continue;
    }
    const auto found = find_log_files(path, out);
    if (!found) {
      return tl::unexpected(found.error());
    }
    all.paths.insert(all.paths.end(), found->paths.begin(), found->paths.end());
    all.passed_over += found->passed_over;
  }
  std::sort(all.paths.begin(), all.paths.end());
  all.paths.erase(std::unique(all.paths.begin(), all.paths.end()), all.paths.end());
  if (all.paths.empty()) {
    return tl::unexpected(
        Error(FileError::is_a_folder)
            .in(input.path)
            .about("the path")
            .got(fmt::format("a folder without a log, with {} other files", all.passed_over))
            .expected("a log, or a folder with files that end in .json, .wpilog or .csv"));
  }
  return all;
}

/// The rows that are done, for who goes on with a run that was ended: a file beside the folder
/// that they are for, which one process at a time holds.
class Journal {
 public:
  static Expected<Journal> open(const std::string& out) {
    std::string path = out;
    while (path.size() > 1 && path.back() == '/') {
      path.pop_back();
    }
    path += ".part.jsonl";
    std::error_code ignored;
    if (const fs::path parent = fs::path(path).parent_path(); !parent.empty()) {
      fs::create_directories(parent, ignored);
    }
    const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (fd < 0) {
      return tl::unexpected(Error(FileError::not_writable)
                                .in(path)
                                .with("system", std::generic_category().message(errno)));
    }
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      ::close(fd);
      return tl::unexpected(Error(FileError::folder_in_use)
                                .in(out)
                                .about("the folder")
                                .got("one that another flyball identify is writing the rows of")
                                .hint("wait for it, or give each part a folder of its own"));
    }
    return Journal(std::move(path), fd);
  }
  Journal(Journal&& other) noexcept
      : path_(std::move(other.path_)), fd_(std::exchange(other.fd_, -1)) {}
  Journal& operator=(Journal&&) = delete;
  ~Journal() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }

  [[nodiscard]] const std::string& path() const { return path_; }

  /// What cannot be kept is done again by who goes on; the answer does not hang on it.
  void add(const std::string& line) const {
    [[maybe_unused]] const ssize_t written = ::write(fd_, line.data(), line.size());
  }

  /// Its rows stand in the folder now.
  void remove() const { ::unlink(path_.c_str()); }

 private:
  Journal(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}

  std::string path_;
  int fd_;
};

using KnownRows = std::unordered_map<std::string, LogRow>;

void take_known(const std::string& path, KnownRows& known) {
  if (const auto text = read_file(path)) {
    if (auto rows = study::read_log_rows(*text, path, /*cut=*/true)) {
      for (NumberedRow& row : rows->rows) {
        std::string name = row.row.path;
        known.insert_or_assign(std::move(name), std::move(row.row));
      }
    }
  }
}

Error given_up(const std::string& path, const Outcome& outcome, const Bounds& bounds) {
  using study::LogRowsError;
  switch (outcome.end) {
    case Outcome::End::too_long:
      return Error(LogRowsError::took_too_long)
          .in(path)
          .about("the log")
          .got(fmt::format("not done after {} s of a processor", bounds.seconds))
          .hint("cut out the part with the tests, or allow more with --log-time");
    case Outcome::End::too_much_memory:
      return Error(LogRowsError::took_too_much_memory)
          .in(path)
          .about("the log")
          .got(fmt::format("not done with {} MB", bounds.megabytes))
          .hint("cut out the part with the tests, or allow more with --log-memory");
    case Outcome::End::answered:
    case Outcome::End::died:
      break;
  }
  return Error(LogRowsError::ended_early)
      .in(path)
      .about("the log")
      .got(outcome.signal == 0 ? std::string("not answered")
                               : fmt::format("not answered: signal {}", outcome.signal))
      .hint("this is a defect of Flyball, unless somebody ended the process");
}

ExpectedAll<LogRows> rows_of(const LogFiles& logs, const study::Shard& shard,
                             const study::IdentifyJob& said_of_all, const Bounds& bounds,
                             const Journal* journal, const KnownRows& known) {
  LogRows rows{logs.paths.size(), {}};
  std::vector<std::size_t> tasks;
  const std::string settings = study::settings_of(said_of_all);
  for (std::size_t number = 0; number < logs.paths.size(); ++number) {
    const auto found = known.find(logs.paths[number]);
    if (shard.holds(number)) {
      tasks.push_back(number);
    } else if (found != known.end() && found->second.settings == settings) {
      rows.rows.push_back({number, found->second});  // another part's, in the same folder
    }
  }
  const auto job_of = [&](std::size_t task) {
    study::IdentifyJob job = said_of_all;
    job.log = logs.paths[tasks[task]];
    return job;
  };
  const auto work = [&](std::size_t task) {
    const study::IdentifyJob job = job_of(task);
    const auto found = known.find(job.log);
    const bool done = found != known.end() && study::still_holds(found->second, job);
    const LogRow row = done ? found->second : study::identify_row(job);
    // A letter says whether it is new.
    return (done ? "k" : "n") + study::to_json_line({tasks[task], row}, logs.paths.size());
  };
  std::size_t ended = 0;
  const auto take = [&](std::size_t task, Outcome outcome) {
    const std::string& path = logs.paths[tasks[task]];
    auto answered = outcome.end == Outcome::End::answered && !outcome.answer.empty()
                        ? study::read_log_rows(std::string_view(outcome.answer).substr(1), path)
                        : Expected<LogRows>(LogRows{});
    const bool whole = answered && answered->rows.size() == 1;
    NumberedRow row =
        whole ? std::move(answered->rows.front())
              : NumberedRow{tasks[task],
                            study::refused_row(job_of(task), given_up(path, outcome, bounds))};
    if (journal != nullptr && whole && outcome.answer.front() == 'n') {
      journal->add(outcome.answer.substr(1));
    }
    rows.rows.push_back(std::move(row));
    tell_progress("identifies logs", ++ended, tasks.size());
  };
  tell_progress("identifies logs", 0, tasks.size());
  if (auto done = work_in_processes(tasks.size(), bounds, work, take); !done) {
    return tl::unexpected(Errors(std::move(done).error()));
  }
  std::sort(rows.rows.begin(), rows.rows.end(),
            [](const auto& a, const auto& b) { return a.number < b.number; });
  return rows;
}

/// What the options and a project file say of every log.
ExpectedAll<study::IdentifyJob> said_of_all_logs(const JobInput& input) {
  if (!input.project.empty()) {
    const auto project = study::read_project_beside_log(input.project, input.given);
    if (!project) {
      return tl::unexpected(project.error());
    }
    if (project->model_job) {
      return tl::unexpected(Errors(
          Error(ArgumentError::out_of_range)
              .in("identify")
              .about("the list of logs")
              .got("a folder, or of logs one by one")
              .expected("one log of a model by formula")
              .hint("several runs stand in one log: where its time jumps a new one begins")));
    }
  }
  return study::identify_job(input.path, input.project, input.given);
}

}  // namespace

void add_each_options(CLI::App& command, const std::shared_ptr<EachOptions>& options) {
  const std::string group = "Logs one by one";
  command.add_flag("--each", options->each, "Identify every log by itself, as those of a folder")
      ->group(group);
  command
      .add_option("--jobs", options->jobs,
                  "Logs at the same time; the answer is the same [one a processor]")
      ->type_name("N")
      ->check(CLI::Range(1, 4096))
      ->group(group);
  command
      .add_option("--shard", options->shard,
                  "Only part I of N, for several machines, such as 2/8: the logs are dealt out by "
                  "turns; flyball merge puts the parts together")
      ->type_name("I/N")
      ->group(group);
  command
      .add_option("--log-time", options->log_seconds,
                  "Processor time that a log may take, in seconds [60]")
      ->type_name("SECONDS")
      ->check(CLI::Range(1.0, 1e6))
      ->group(group);
  command
      .add_option("--log-memory", options->log_megabytes,
                  "Memory that a log may take, in megabytes [2048]")
      ->type_name("MB")
      ->check(CLI::Range(16, 1 << 20))
      ->group(group);
}

bool means_each(const JobInput& input, const EachOptions& options) {
  const auto is_folder = [](const std::string& path) {
    std::error_code ignored;
    return fs::is_directory(path, ignored);
  };
  return options.each || !options.shard.empty() || options.jobs > 0 || options.log_seconds > 0.0 ||
         options.log_megabytes > 0 || is_folder(input.path) ||
         std::any_of(input.more.begin(), input.more.end(), is_folder);
}

int identify_each(JobInput& input, const EachOptions& options, const CommonOptions& common) {
  const auto refuse = [&](const Errors& errors) { return fail(errors, common, input.schema); };
  const auto shard = options.shard.empty() ? Expected<study::Shard>(study::Shard{})
                                           : study::parse_shard(options.shard);
  if (!shard) {
    return refuse(shard.error());
  }
  const auto said = said_of_all_logs(input);
  if (!said) {
    return refuse(said.error());
  }
  const auto logs = logs_of(input, common.out);
  if (!logs) {
    return refuse(logs.error());
  }
  std::optional<Journal> journal;
  KnownRows known;
  if (!common.out.empty()) {
    auto opened = Journal::open(common.out);
    if (!opened) {
      return refuse(opened.error());
    }
    journal.emplace(*std::move(opened));
    take_known((fs::path(common.out) / "logs.jsonl").string(), known);
    take_known(journal->path(), known);
  }
  Bounds bounds;
  bounds.processes = options.jobs > 0 ? options.jobs : usable_processors();
  bounds.seconds = options.log_seconds > 0.0 ? options.log_seconds : bounds.seconds;
  bounds.megabytes = options.log_megabytes > 0 ? options.log_megabytes : bounds.megabytes;
  const auto rows = rows_of(*logs, *shard, *said, bounds, journal ? &*journal : nullptr, known);
  if (!rows) {
    return refuse(rows.error());
  }
  return tell_rows(*rows, logs->passed_over, common, [&] {
    if (journal) {
      journal->remove();
    }
  });
}

int tell_rows(const LogRows& rows, std::size_t passed_over, const CommonOptions& common,
              const std::function<void()>& written) {
  const Answer answer = study::answer_of(rows, passed_over);
  if (!common.out.empty()) {
    tell_progress("writes the report");
    if (const auto report = report::write_report(answer, common.out, {.command = common.typed});
        !report) {
      return fail(report.error(), common, identify_each_schema);
    }
  }
  if (written) {
    written();
  }
  if (!common.json) {
    print(report::to_terminal(answer.document, terminal_style(), common.out));
    return status_of(rows);
  }
  std::string lines;
  for (const NumberedRow& row : rows.rows) {
    lines += study::to_json_line(row, rows.logs);
  }
  print(lines);
  return status_of(rows);
}

}  // namespace flyball::app
