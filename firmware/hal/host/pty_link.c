#include "pty_link.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

/* The terminal's read buffer holds 4096 bytes; behind it the kernel would queue 64 KB more, seconds of old samples. */
#define UNREAD_LIMIT 3840

static bool complain(const char *what)
{
    fprintf(stderr, "gsense_board: %s: %s\n", what, strerror(errno));
    return false;
}

static bool make_link(const char *target, const char *link)
{
    char temporary[4096];
    const int length = snprintf(temporary, sizeof temporary, "%s.%ld", link, (long)getpid());
    if (length < 0 || (size_t)length >= sizeof temporary) {
        errno = ENAMETOOLONG;
        return false;
    }
    if (symlink(target, temporary) != 0) {
        return false;
    }
    if (rename(temporary, link) != 0) {
        const int reason = errno;
        unlink(temporary);
        errno = reason;
        return false;
    }
    return true;
}

static bool make_raw(int fd)
{
    struct termios settings;
    if (tcgetattr(fd, &settings) != 0) {
        return false;
    }
    cfmakeraw(&settings);
    return tcsetattr(fd, TCSANOW, &settings) == 0;
}

bool pty_open(pty_link *pty, const char *link)
{
    memset(pty, 0, sizeof *pty);
    pty->slave = -1;
    pty->master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (pty->master < 0 || grantpt(pty->master) != 0 || unlockpt(pty->master) != 0 ||
        ptsname_r(pty->master, pty->path, sizeof pty->path) != 0) {
        return complain("no pseudo-terminal");
    }
    pty->slave = open(pty->path, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (pty->slave < 0 || !make_raw(pty->slave) || fcntl(pty->master, F_SETFL, O_NONBLOCK) != 0) {
        return complain(pty->path);
    }
    if (link != NULL && !make_link(pty->path, link)) {
        return complain(link);
    }
    pty->link = link;
    return true;
}

static pty_packet *packet_at(pty_link *pty, size_t index) { return &pty->queue[(pty->first + index) % PTY_QUEUE]; }

static void drop_first(pty_link *pty)
{
    truth_drop(&packet_at(pty, 0)->truth, &packet_at(pty, 1)->truth);
    pty->first = (pty->first + 1) % PTY_QUEUE;
    --pty->waiting;
}

void pty_send(pty_link *pty, const pty_packet *packet)
{
    pty_packet newest = *packet;
    if (pty->has_dropped_last) {
        truth_drop(&pty->dropped_last, &newest.truth);
        pty->has_dropped_last = false;
    }
    if (pty->waiting == PTY_QUEUE) {
        ++pty->dropped;
        if (pty->sent_of_first > 0) { /* begun: the newest goes instead */
            pty->dropped_last = newest.truth;
            pty->has_dropped_last = true;
            return;
        }
        drop_first(pty);
    }
    *packet_at(pty, pty->waiting) = newest;
    ++pty->waiting;
}

uint64_t pty_next_due(const pty_link *pty) { return pty->waiting > 0 ? pty->queue[pty->first].due_ns : UINT64_MAX; }

/* FIONREAD alone does not see what the kernel's worker has not yet passed on to the terminal's read buffer (after more than
 * a second on a loaded machine); a poll waits for that worker. */
size_t pty_unread(const pty_link *pty)
{
    struct pollfd input = {.fd = pty->slave, .events = POLLIN};
    int unread = 0;
    const bool known = poll(&input, 1, 0) >= 0 && ioctl(pty->slave, FIONREAD, &unread) == 0;
    return known ? (size_t)unread : 0u;
}

size_t pty_left(const pty_link *pty) { return pty->waiting * PTY_PACKET_SIZE + pty_unread(pty); }

static bool has_room(const pty_link *pty, size_t size)
{
    int unread = 0;
    return ioctl(pty->slave, FIONREAD, &unread) == 0 && (size_t)unread + size <= UNREAD_LIMIT;
}

/* False: the terminal has no room for more. */
static bool send_first(pty_link *pty)
{
    const pty_packet *packet = packet_at(pty, 0);
    const size_t left = packet->size - pty->sent_of_first;
    if (!has_room(pty, left)) {
        return false;
    }
    const ssize_t written = write(pty->master, &packet->bytes[pty->sent_of_first], left);
    if (written <= 0) {
        return false;
    }
    pty->sent_of_first += (size_t)written;
    if (pty->sent_of_first == packet->size) {
        truth_deliver(&pty->delivered, &packet->truth);
        pty->first = (pty->first + 1) % PTY_QUEUE;
        --pty->waiting;
        pty->sent_of_first = 0;
    }
    return true;
}

void pty_service(pty_link *pty, uint64_t now_ns)
{
    uint8_t unwanted[256];
    while (read(pty->master, unwanted, sizeof unwanted) > 0) {
    }
    while (pty_next_due(pty) <= now_ns && send_first(pty)) {
    }
}

void pty_close(pty_link *pty)
{
    if (pty->link != NULL) {
        char target[PTY_PATH_SIZE];
        const ssize_t length = readlink(pty->link, target, sizeof target - 1);
        if (length > 0) {
            target[length] = '\0';
            if (strcmp(target, pty->path) == 0) {
                unlink(pty->link);
            }
        }
    }
    if (pty->slave >= 0) {
        close(pty->slave);
    }
    if (pty->master >= 0) {
        close(pty->master);
    }
}
