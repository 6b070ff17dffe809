/* A PLC behind libmodbus, with the bench_int16 registers: a motor of first order, no physics more.
 *
 * libmodbus_plc REMOTE_AFTER_SECONDS
 * Prints "listening on 127.0.0.1:PORT", and at SIGTERM what it saw. Once enabled, a truck pushes the
 * drum with a torque of PUSH at the sensor, so that a gateway has something to follow. The sensor has
 * some noise, and the current balances torque and acceleration of the motor as on the bench.
 */
#include <arpa/inet.h>
#include <math.h>
#include <modbus.h>
#include <poll.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/timerfd.h>
#include <unistd.h>

enum { COMMAND = 64, CMD_SEQ = 64, HB_GW, CTRL, MODE, SPEED_REF, WD_TIMEOUT = 72, REGISTERS = 80 };
static const double PUSH = 8.0, TIME_CONSTANT = 0.1, SCAN = 0.01, RATIO = 62.6;
static const double MOTOR_INERTIA = 0.128, FLUX = 1.8506; /* kg m^2, N m/A: Table 3.1 */
static volatile sig_atomic_t stopped;
static uint16_t *r;
static unsigned scans, commands, enabled_scans;
static double speed_rpm, speed_max, integral;

static void stop(int signal) { stopped = signal; }

static void put32(int address, uint32_t value) { r[address] = value >> 16, r[address + 1] = value; }

static void scan(unsigned remote_after) {
    static uint16_t sequence, heartbeat;
    static unsigned age = 6000;
    static int enabled, was_asked;
    int remote = ++scans >= remote_after, asked = r[CTRL] & 1;
    if (r[CMD_SEQ] != sequence) sequence = r[CMD_SEQ], commands++;
    age = r[HB_GW] != heartbeat ? 0 : age + 1;
    heartbeat = r[HB_GW];
    if (asked && !was_asked && remote && r[MODE] == 4) enabled = 1;
    if (!asked || !remote || age * 10 > r[WD_TIMEOUT]) enabled = 0;
    was_asked = asked;
    enabled_scans += enabled;

    double target = enabled ? (int16_t)r[SPEED_REF] * 0.2 : 0.0, torque = enabled ? PUSH : 0.0;
    double acceleration = (target - speed_rpm) * M_PI / 30 / TIME_CONSTANT;
    torque += 0.05 * ((int)(scans % 5) - 2);
    double current = (MOTOR_INERTIA * acceleration - torque) / FLUX;
    speed_rpm += (target - speed_rpm) * SCAN / TIME_CONSTANT;
    if (speed_rpm > speed_max) speed_max = speed_rpm;
    integral += torque * SCAN;

    r[0] = r[1] = r[31] = scans;
    put32(2, scans * 100);
    r[4] = (!enabled) | enabled << 1 | remote << 2 | enabled << 3 | 1 << 6 | (age < 20) << 7 | 1 << 8;
    r[5] = enabled ? 4 : 1;
    r[8] = (int16_t)lround(speed_rpm / 0.2);
    r[9] = (int16_t)lround(speed_rpm * M_PI / 30 / RATIO / 0.0005);
    r[10] = r[11] = (int16_t)lround(torque / 0.01);
    r[12] = (int16_t)lround(current / 0.01);
    r[14] = (int16_t)lround(target / 0.2);
    r[15] = r[16] = 320;
    r[17] = 0x8000;
    put32(18, (uint32_t)llround(integral / 0.0001));
    r[24] = sequence;
    r[25] = age > 6000 ? 60000 : age * 10;
    r[27] = 63;
    r[28] = (uint16_t)-12345;
    put32(29, 0x12345678);
}

int main(int argc, char **argv) {
    unsigned remote_after = argc > 1 ? (unsigned)(atof(argv[1]) / SCAN) : 0;
    modbus_t *server = modbus_new_tcp("127.0.0.1", 0);
    modbus_mapping_t *map = modbus_mapping_new(0, 0, REGISTERS, 0);
    struct sockaddr_in address;
    socklen_t size = sizeof address;
    uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
    uint64_t expired;
    int listening = modbus_tcp_listen(server, 2), clock = timerfd_create(CLOCK_MONOTONIC, 0);
    struct itimerspec period = {{0, 10000000}, {0, 10000000}};
    struct pollfd wait[3] = {{clock, POLLIN, 0}, {listening, POLLIN, 0}, {-1, POLLIN, 0}};

    if (!map || listening < 0 || clock < 0) return perror("libmodbus_plc"), 1;
    r = map->tab_registers;
    signal(SIGTERM, stop);
    timerfd_settime(clock, 0, &period, NULL);
    getsockname(listening, (struct sockaddr *)&address, &size);
    printf("listening on 127.0.0.1:%d\n", ntohs(address.sin_port)), fflush(stdout);
    while (!stopped) {
        if (poll(wait, 3, -1) < 0) continue;
        if (wait[0].revents && read(clock, &expired, sizeof expired) > 0)
            while (expired--) scan(remote_after);
        if (wait[2].revents) {
            int length = modbus_receive(server, request);
            if (length > 0) modbus_reply(server, request, length, map);
            if (length < 0) close(wait[2].fd), wait[2].fd = -1;
        }
        if (wait[1].revents) {
            if (wait[2].fd >= 0) close(wait[2].fd);
            wait[2].fd = modbus_tcp_accept(server, &listening);
        }
    }
    printf("commands %u enabled_scans %u speed_max %.1f\n", commands, enabled_scans, speed_max);
    return 0;
}
