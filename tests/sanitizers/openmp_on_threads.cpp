// OpenMP for ThreadSanitizer: what GCC calls for `#pragma omp`, on threads and locks that the sanitizer sees.
// GCC's own runtime waits by futexes, which the sanitizer takes for no synchronization at all. Only what the core uses.
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace {

struct Loop {
  long next, end, step, chunk;
};

struct Team {
  explicit Team(unsigned size) : size(size) {}
  const unsigned size;
  std::mutex mutex;
  std::condition_variable all_there;
  unsigned waiting = 0, barriers = 0;  // threads at the barrier, barriers passed
  unsigned singles = 0;                // `single` blocks that a thread has taken
  std::vector<Loop> loops;             // in the order of the program, which is the same in every thread
};

// What a thread of a team has come to.
struct Place {
  Team* team = nullptr;
  unsigned thread = 0, singles = 0, loops = 0;
};
thread_local Place here;

bool take_chunk(long* begin, long* end) {
  std::lock_guard lock(here.team->mutex);
  Loop& loop = here.team->loops[here.loops - 1];
  const long left = (loop.end - loop.next + loop.step - 1) / loop.step;
  if (left <= 0) return false;
  *begin = loop.next;
  *end = loop.next += loop.step * (left < loop.chunk ? left : loop.chunk);
  if (*end > loop.end) *end = loop.end;
  return true;
}

}  // namespace

#pragma GCC visibility push(hidden)  // of this library alone
extern "C" {

int omp_get_thread_num() { return int(here.thread); }
int omp_get_num_threads() { return here.team ? int(here.team->size) : 1; }

void GOMP_parallel(void (*work)(void*), void* data, unsigned count, unsigned) {
  Team team(count ? count : std::thread::hardware_concurrency());
  auto join_team = [&](unsigned thread) {
    const Place before = here;
    here = {&team, thread, 0, 0};
    work(data);
    here = before;
  };
  std::vector<std::thread> others;
  for (unsigned thread = 1; thread < team.size; thread++) others.emplace_back(join_team, thread);
  join_team(0);
  for (std::thread& other : others) other.join();
}

void GOMP_barrier() {
  Team* team = here.team;
  if (!team) return;
  std::unique_lock lock(team->mutex);
  const unsigned passed = team->barriers;
  if (++team->waiting == team->size) {
    team->waiting = 0;
    team->barriers++;
    team->all_there.notify_all();
  } else {
    team->all_there.wait(lock, [&] { return team->barriers != passed; });
  }
}

bool GOMP_single_start() {
  if (!here.team) return true;
  std::lock_guard lock(here.team->mutex);
  if (here.team->singles > here.singles++) return false;
  here.team->singles++;
  return true;
}

bool GOMP_loop_nonmonotonic_dynamic_start(long start, long end, long step, long chunk, long* from, long* to) {
  {
    std::lock_guard lock(here.team->mutex);
    if (here.team->loops.size() == here.loops++) here.team->loops.push_back({start, end, step, chunk});
  }
  return take_chunk(from, to);
}

bool GOMP_loop_nonmonotonic_dynamic_next(long* from, long* to) { return take_chunk(from, to); }

void GOMP_loop_end_nowait() {}

}  // extern "C"
#pragma GCC visibility pop
