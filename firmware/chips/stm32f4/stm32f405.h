/* SPDX-License-Identifier: MIT */
/**
 * The registers of the STM32F405 that this project uses, under the names of ST's reference manual RM0090 (and of the
 * Armv7-M manual for the core's own). Written from those manuals; a register that is not used here is only a gap of
 * the right size.
 */
#ifndef STM32F405_H
#define STM32F405_H

#include <stddef.h>
#include <stdint.h>

#define BIT(n) ((uint32_t)1 << (n))

/* Reset and clock control, RM0090 section 7.3 */
typedef struct {
    volatile uint32_t CR, PLLCFGR, CFGR;
    uint32_t reserved_0c[9];
    volatile uint32_t AHB1ENR;
    uint32_t reserved_34[3];
    volatile uint32_t APB1ENR, APB2ENR;
    uint32_t reserved_48[11];
    volatile uint32_t CSR;
} rcc_t;
_Static_assert(offsetof(rcc_t, AHB1ENR) == 0x30 && offsetof(rcc_t, APB2ENR) == 0x44 && offsetof(rcc_t, CSR) == 0x74,
               "RM0090 table 34");
#define RCC                ((rcc_t *)0x40023800UL)
#define RCC_CR_HSEON       BIT(16)
#define RCC_CR_HSERDY      BIT(17)
#define RCC_CR_CSSON       BIT(19)
#define RCC_CR_PLLON       BIT(24)
#define RCC_CR_PLLRDY      BIT(25)
#define RCC_PLLCFGR_M(m)   ((uint32_t)(m))
#define RCC_PLLCFGR_N(n)   ((uint32_t)(n) << 6)
#define RCC_PLLCFGR_P2     0UL
#define RCC_PLLCFGR_HSE    BIT(22)
#define RCC_PLLCFGR_Q(q)   ((uint32_t)(q) << 24)
#define RCC_CFGR_SW_MASK   3UL
#define RCC_CFGR_SW_PLL    2UL
#define RCC_CFGR_SWS_MASK  (3UL << 2)
#define RCC_CFGR_SWS_PLL   (2UL << 2)
#define RCC_CFGR_PPRE1_4   (5UL << 10)
#define RCC_CFGR_PPRE2_2   (4UL << 13)
#define RCC_AHB1ENR_GPIOA  BIT(0)
#define RCC_AHB1ENR_GPIOB  BIT(1)
#define RCC_APB1ENR_TIM2   BIT(0)
#define RCC_APB1ENR_TIM5   BIT(3)
#define RCC_APB1ENR_DAC    BIT(29)
#define RCC_APB1ENR_PWR    BIT(28)
#define RCC_CSR_RMVF       BIT(24)
#define RCC_CSR_BORRSTF    BIT(25)
#define RCC_CSR_PINRSTF    BIT(26)
#define RCC_CSR_PORRSTF    BIT(27)
#define RCC_CSR_SFTRSTF    BIT(28)
#define RCC_CSR_IWDGRSTF   BIT(29)
#define RCC_APB2ENR_USART1 BIT(4)
#define RCC_APB2ENR_ADC1   BIT(8)

/* Power control, section 5.4 */
typedef struct {
    volatile uint32_t CR, CSR;
} pwr_t;
#define PWR            ((pwr_t *)0x40007000UL)
#define PWR_CR_PVDE    BIT(4)
#define PWR_CR_PLS_2V9 (7UL << 5)
#define PWR_CR_VOS     BIT(14)
#define PWR_CSR_PVDO   BIT(2)

/* Independent watchdog, section 21.4 */
typedef struct {
    volatile uint32_t KR, PR, RLR, SR;
} iwdg_t;
#define IWDG           ((iwdg_t *)0x40003000UL)
#define IWDG_KR_FEED   0xAAAAUL
#define IWDG_KR_UNLOCK 0x5555UL
#define IWDG_KR_START  0xCCCCUL
#define IWDG_PR_64     4UL

/* Flash interface, section 3.9 */
typedef struct {
    volatile uint32_t ACR, KEYR, OPTKEYR, SR, CR, OPTCR;
} flash_t;
#define FLASH_SR_BSY           BIT(16)
#define FLASH_SR_ERRORS        0xF2UL /* operation, write protection, alignment, parallelism, sequence */
#define FLASH_CR_PG            BIT(0)
#define FLASH_CR_SER           BIT(1)
#define FLASH_CR_SNB(n)        ((uint32_t)(n) << 3)
#define FLASH_CR_PSIZE_32      (2UL << 8)
#define FLASH_CR_STRT          BIT(16)
#define FLASH_CR_LOCK          BIT(31)
#define FLASH_KEY1             0x45670123UL
#define FLASH_KEY2             0xCDEF89ABUL
#define FLASH_ACR_DCRST        BIT(12)
#define FLASH_OPTCR_OPTLOCK    BIT(0)
#define FLASH_OPTCR_OPTSTRT    BIT(1)
#define FLASH_OPTCR_BOR_MASK   ((uint32_t)3 << 2)
#define FLASH_OPTKEY1          0x08192A3BUL
#define FLASH_OPTKEY2          0x4C5D6E7FUL
#define FLASH                  ((flash_t *)0x40023C00UL)
#define FLASH_ACR_LATENCY(n)   ((uint32_t)(n))
#define FLASH_ACR_LATENCY_MASK 7UL
#define FLASH_ACR_PRFTEN       BIT(8)
#define FLASH_ACR_ICEN         BIT(9)
#define FLASH_ACR_DCEN         BIT(10)

/* General-purpose I/O, section 8.4. Two bits of MODER and PUPDR a pin, four of AFR. */
typedef struct {
    volatile uint32_t MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR, AFR[2];
} gpio_t;
_Static_assert(offsetof(gpio_t, AFR) == 0x20, "RM0090 table 39");
#define GPIOA                ((gpio_t *)0x40020000UL)
#define GPIOB                ((gpio_t *)0x40020400UL)
#define GPIO_MODE_OUTPUT     1UL
#define GPIO_MODE_ALTERNATE  2UL
#define GPIO_MODE_ANALOG     3UL
#define GPIO_PULL_UP         1UL
#define GPIO_PULL_DOWN       2UL
#define GPIO_BSRR_SET(pin)   BIT(pin)
#define GPIO_BSRR_RESET(pin) BIT((pin) + 16U)

/* Universal synchronous/asynchronous receiver transmitter, section 30.6 */
typedef struct {
    volatile uint32_t SR, DR, BRR, CR1, CR2, CR3;
} usart_t;
#define USART1           ((usart_t *)0x40011000UL)
#define USART_SR_PE      BIT(0)
#define USART_SR_FE      BIT(1)
#define USART_SR_NF      BIT(2)
#define USART_SR_ORE     BIT(3)
#define USART_SR_RXNE    BIT(5)
#define USART_SR_TC      BIT(6)
#define USART_SR_TXE     BIT(7)
#define USART_CR1_RE     BIT(2)
#define USART_CR1_TE     BIT(3)
#define USART_CR1_RXNEIE BIT(5)
#define USART_CR1_PS     BIT(9)
#define USART_CR1_PCE    BIT(10)
#define USART_CR1_M      BIT(12)
#define USART_CR1_UE     BIT(13)

/* General-purpose timers TIM2 to TIM5, section 18.4. TIM2 and TIM5 count 32 bits. */
typedef struct {
    volatile uint32_t CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR;
    uint32_t reserved_30;
    volatile uint32_t CCR1, CCR2, CCR3, CCR4;
} timer_t;
_Static_assert(offsetof(timer_t, CNT) == 0x24 && offsetof(timer_t, CCR4) == 0x40, "RM0090 table 99");
#define TIM2               ((timer_t *)0x40000000UL)
#define TIM5               ((timer_t *)0x40000C00UL)
#define TIM_CR1_CEN        BIT(0)
#define TIM_CR2_MMS_UPDATE (2UL << 4)
#define TIM_CCMR1_OC2_PWM2 (7UL << 12)
#define TIM_CCER_CC2E      BIT(4)
#define TIM_DIER_UIE       BIT(0)
#define TIM_SR_UIF         BIT(0)
#define TIM_EGR_UG         BIT(0)

/* Analog-to-digital converter, section 13.13 */
typedef struct {
    volatile uint32_t SR, CR1, CR2, SMPR1, SMPR2;
    uint32_t reserved_14[6];
    volatile uint32_t SQR1, SQR2, SQR3, JSQR, JDR1;
    uint32_t reserved_40[3];
    volatile uint32_t DR;
} adc_t;
_Static_assert(offsetof(adc_t, SQR1) == 0x2C && offsetof(adc_t, JSQR) == 0x38 && offsetof(adc_t, DR) == 0x4C,
               "RM0090 table 71");
typedef struct {
    volatile uint32_t CSR, CCR;
} adc_common_t;
#define ADC1                      ((adc_t *)0x40012000UL)
#define ADC_COMMON                ((adc_common_t *)0x40012300UL)
#define ADC_SR_EOC                BIT(1)
#define ADC_SR_JEOC               BIT(2)
#define ADC_CR2_ADON              BIT(0)
#define ADC_CR2_JSWSTART          BIT(22)
#define ADC_CR2_EXTSEL_TIM2_CC2   (3UL << 24)
#define ADC_CR2_EXTEN_RISING      (1UL << 28)
#define ADC_CR2_SWSTART           BIT(30)
#define ADC_SMPR_56_CYCLES        3UL
#define ADC_SMPR2_CHANNEL(n, smp) ((smp) << (3U * (n)))
#define ADC_SMPR_480_CYCLES       7UL
#define ADC_SMPR1_CHANNEL(n, smp) ((smp) << (3U * ((n)-10U)))
#define ADC_JSQR_SINGLE(n)        ((uint32_t)(n) << 15)
#define ADC_CCR_ADCPRE_4          (1UL << 16)
#define ADC_CCR_TSVREFE           BIT(23)

/* Digital-to-analog converter, section 14.5 */
typedef struct {
    volatile uint32_t CR, SWTRIGR, DHR12R1, DHR12L1;
    uint32_t reserved_10[7];
    volatile uint32_t DOR1;
} dac_t;
_Static_assert(offsetof(dac_t, DHR12L1) == 0x0C && offsetof(dac_t, DOR1) == 0x2C, "RM0090 table 76");
#define DAC               ((dac_t *)0x40007400UL)
#define DAC_CR_EN1        BIT(0)
#define DAC_CR_TEN1       BIT(2)
#define DAC_CR_TSEL1_TIM2 (4UL << 3)

/* Interrupt numbers, RM0090 table 62 */
enum { IRQ_TIM2 = 28, IRQ_USART1 = 37, IRQ_COUNT = 82 };

/* Written at the factory: unique identifier (RM0090 section 39.1), and what the converter read at 3.3 V (STM32F405
 * datasheet, tables of the temperature sensor and of the internal reference). */
#define UNIQUE_ID      ((const volatile uint32_t *)0x1FFF7A10UL)
#define VREFINT_CAL    (*(const volatile uint16_t *)0x1FFF7A2AUL)
#define TS_CAL_30      (*(const volatile uint16_t *)0x1FFF7A2CUL)
#define TS_CAL_110     (*(const volatile uint16_t *)0x1FFF7A2EUL)
#define DBGMCU_IDCODE  (*(const volatile uint32_t *)0xE0042000UL)
#define DBGMCU_ID_MASK 0xFFFUL
#define DBGMCU_ID_F405 0x413UL

/* Core: Armv7-M Architecture Reference Manual, sections B3 and C1 */
#define NVIC_ISER       ((volatile uint32_t *)0xE000E100UL)
#define NVIC_IPR        ((volatile uint8_t *)0xE000E400UL)
#define SCB_CPACR       (*(volatile uint32_t *)0xE000ED88UL)
#define SCB_CPACR_FPU   (0xFUL << 20)
#define SCB_AIRCR       (*(volatile uint32_t *)0xE000ED0CUL)
#define SCB_AIRCR_RESET 0x05FA0004UL
#define SCB_CFSR        (*(volatile uint32_t *)0xE000ED28UL)
typedef struct {
    volatile uint32_t TYPE, CTRL, RNR, RBAR, RASR;
} mpu_t;
#define MPU                 ((mpu_t *)0xE000ED90UL)
#define MPU_CTRL_ENABLE     BIT(0)
#define MPU_CTRL_PRIVDEFENA BIT(2)
#define MPU_RASR_ENABLE     BIT(0)
#define MPU_RASR_256_BYTES  (7UL << 1)
#define MPU_RASR_XN         BIT(28)
#define DBGMCU_APB1_FZ      (*(volatile uint32_t *)0xE0042008UL)
#define DBGMCU_APB1_FZ_IWDG BIT(12)
typedef struct {
    volatile uint32_t CSR, RVR, CVR;
} systick_t;
#define SYSTICK               ((systick_t *)0xE000E010UL)
#define SYSTICK_CSR_ENABLE    BIT(0)
#define SYSTICK_CSR_TICKINT   BIT(1)
#define SYSTICK_CSR_CLKSOURCE BIT(2)
#define DEMCR                 (*(volatile uint32_t *)0xE000EDFCUL)
#define DEMCR_TRCENA          BIT(24)
#define DWT_CTRL              (*(volatile uint32_t *)0xE0001000UL)
#define DWT_CTRL_CYCCNTENA    BIT(0)
#define DWT_CYCCNT            (*(volatile uint32_t *)0xE0001004UL)

/** Lets an interrupt through. Of the 8 bits of priority the chip has the upper 4: 0 (first) to 15. */
static inline void nvic_enable(unsigned irq, unsigned priority) {
    NVIC_IPR[irq] = (uint8_t)(priority << 4);
    NVIC_ISER[irq / 32U] = BIT(irq % 32U);
}

/** What was stored before has arrived. */
static inline void wait_for_stores(void) {
    __asm__ volatile("dsb" ::: "memory");
}

#endif
