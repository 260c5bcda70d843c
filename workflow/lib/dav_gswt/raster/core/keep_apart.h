// Threads that share a processor while another idles.
#pragma once

namespace raster {

// Keeps the other threads of a team of `threads` off the processor that the calling thread is on. Some kernels (seen
// in virtual machines) wake a thread where its waker runs and leave it there: a team that sleeps while it waits is
// then no faster than one thread. Does nothing if the caller is on `before`, the processor that the last call
// returned, nor on any system but Linux.
int keep_apart(int threads, int before);

}  // namespace raster
