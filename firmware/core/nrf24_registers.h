/* Nordic nRF24L01+: registers and commands (product specification 1.0, chapters 8 and 9). */
#ifndef GSENSE_NRF24_REGISTERS_H
#define GSENSE_NRF24_REGISTERS_H

#define NRF_CONFIG 0x00u
#define NRF_EN_AA 0x01u
#define NRF_EN_RXADDR 0x02u
#define NRF_SETUP_AW 0x03u
#define NRF_SETUP_RETR 0x04u
#define NRF_RF_CH 0x05u
#define NRF_RF_SETUP 0x06u
#define NRF_STATUS 0x07u
#define NRF_OBSERVE_TX 0x08u
#define NRF_RX_ADDR_P0 0x0Au
#define NRF_TX_ADDR 0x10u
#define NRF_RX_PW_P0 0x11u
#define NRF_FIFO_STATUS 0x17u
#define NRF_DYNPD 0x1Cu
#define NRF_FEATURE 0x1Du
#define NRF_REGISTERS 0x1Eu

#define NRF_CONFIG_PRIM_RX 0x01u
#define NRF_CONFIG_PWR_UP 0x02u
#define NRF_CONFIG_CRC_16 0x0Cu /* EN_CRC and CRCO */
#define NRF_STATUS_MAX_RT 0x10u
#define NRF_STATUS_TX_DS 0x20u
#define NRF_STATUS_RX_DR 0x40u
#define NRF_STATUS_FLAGS 0x70u
#define NRF_STATUS_TX_FULL 0x01u
#define NRF_FIFO_RX_EMPTY 0x01u
#define NRF_FIFO_RX_FULL 0x02u
#define NRF_FIFO_TX_EMPTY 0x10u
#define NRF_FIFO_TX_FULL 0x20u
#define NRF_RF_2_MBIT_0_DBM 0x0Eu
#define NRF_FEATURE_DPL 0x04u /* dynamic payload length: what R_RX_PL_WID needs */

#define NRF_R_REGISTER 0x00u
#define NRF_W_REGISTER 0x20u
#define NRF_R_RX_PL_WID 0x60u
#define NRF_R_RX_PAYLOAD 0x61u
#define NRF_W_TX_PAYLOAD 0xA0u
#define NRF_FLUSH_TX 0xE1u
#define NRF_FLUSH_RX 0xE2u
#define NRF_NOP 0xFFu

#define NRF_ADDRESS_BYTES 5u
#define NRF_PAYLOAD 32u
#define NRF_FIFO_DEPTH 3u

#endif
