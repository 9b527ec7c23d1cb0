! SPDX-License-Identifier: MIT
!> Factors with which a code of practice designs: strengths are divided, loads and water are multiplied.
module rockdda_run_design_factors
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : lower_case, to_string
   use rockdda_model_options, only : is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : count_words, word_of
   use rockdda_base_numbers, only : number_status, parse_number
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_run_given_loads, only : choose_loads, given_loads_type, multiply_loads, name_length
   implicit none
   private
   public :: design_factors_type, read_factors, factor_names

   character(len=*), parameter :: factor_names(4) = [character(len=8) :: 'friction', 'cohesion', 'tension', 'water']
   character(len=*), parameter :: of_load = 'load.', option = '--factors'
   !> EN 1997-1, Annex A, sets M2 and A2: strengths, and variable loads that are unfavourable.
   real(wp), parameter :: ec7_strength = 1.25_wp, ec7_loads = 1.3_wp

   type :: design_factors_type
      real(wp) :: strength(3) = 1      !! of tan(phi), cohesion, tension: divided
      real(wp) :: water = 1            !! of its pressure
      character(len=name_length), allocatable :: load_names(:)
      real(wp), allocatable :: loads(:)
   contains
      procedure :: multiply
      procedure :: to_text
   end type design_factors_type

contains

   !> Read 'friction = 1.25, load.traffic = 1.3', or 'ec7'. Errors: unknown names, values that are not above 0,
   !> strengths that would be increased.
   subroutine read_factors(text, variable_loads, loads, factors, error)
      character(len=*), intent(in) :: text
      character(len=*), intent(in) :: variable_loads        !! names, for ec7; empty: all that have a name
      type(given_loads_type), intent(in) :: loads
      type(design_factors_type), intent(out) :: factors
      type(error_type), allocatable, intent(out) :: error
      character(len=name_length), allocatable :: one(:)
      character(len=:), allocatable :: word, name, given
      real(wp) :: value
      integer :: equals, i, k, status
      allocate (factors%load_names(0), factors%loads(0))
      if (lower_case(trim(adjustl(text))) == 'ec7') then
         factors%strength = ec7_strength
         if (len_trim(variable_loads) > 0 .or. size(loads%names()) > 0) &
            call choose_loads(loads, variable_loads, '--loads', factors%load_names, error)
         factors%loads = spread(ec7_loads, 1, size(factors%load_names))
         return
      end if
      if (len_trim(variable_loads) > 0) then
         call make_error(error, error_code%input, 'option --loads: belongs to --search load and to --factors ec7; '// &
                         'give a factor with --factors "load.NAME = 1.3"')
         return
      end if
      given = ','
      do k = 1, count_words(text)
         word = word_of(text, k)
         equals = index(word, '=')
         if (equals == 0) then
            call make_error(error, error_code%input, 'option --factors: expected ec7 or NAME = VALUE, found '// &
                            "'"//word//"'")
            return
         end if
         name = lower_case(trim(adjustl(word(1:equals - 1))))
         call parse_number(trim(adjustl(word(equals + 1:))), value, status)
         if (status /= number_status%ok) value = -1
         if (index(given, ','//name//',') > 0) then
            call make_error(error, error_code%input, 'option --factors: '//name//' is given twice')
            return
         end if
         given = given//name//','
         if (.not. value > 0) then
            call make_error(error, error_code%input, 'option --factors: '//name//": expected a number above 0, "// &
                            "found '"//trim(adjustl(word(equals + 1:)))//"'")
            return
         end if
         if (index(name, of_load) == 1) then
            call choose_loads(loads, name(len(of_load) + 1:), option, one, error)
            if (allocated(error)) return
            factors%load_names = [factors%load_names, one]
            factors%loads = [factors%loads, spread(value, 1, size(one))]
            cycle
         end if
         do i = 1, size(factor_names)
            if (factor_names(i) == name) exit
         end do
         if (i <= 3 .and. value < 1) then
            call make_error(error, error_code%input, 'option --factors: '//name//': strengths are divided by their '// &
                            'factor, which is at least 1; found '//to_string(value)//', with which joints would be '// &
                            'stronger')
            return
         end if
         if (i <= 3) factors%strength(i) = value
         if (i == 4) factors%water = value
         if (i <= 4) cycle
         call make_error(error, error_code%input, "option --factors: '"//name// &
                         "' is none of friction, cohesion, tension, water, load.NAME"//did_you_mean(name, factor_names))
         return
      end do
   end subroutine read_factors

   !> Multiply loads and water of a model. Error: a factor of water that the model does not have.
   subroutine multiply(self, loads, parameters, error)
      class(design_factors_type), intent(in) :: self
      type(given_loads_type), intent(in) :: loads
      type(parameters_type), intent(inout) :: parameters
      type(error_type), allocatable, intent(out) :: error
      integer :: i, n
      do i = 1, size(self%loads)
         call multiply_loads(loads, self%load_names(i:i), self%loads(i), parameters)
      end do
      if (.not. abs(self%water - 1) > 0) return
      n = 0
      if (allocated(parameters%water)) n = size(parameters%water)
      if (n == 0) call make_error(error, error_code%input, 'option --factors: water: the model has no &water')
      do i = 1, n
         associate (water => parameters%water(i))
            if (is_set(water%unit_weight)) water%unit_weight = self%water*water%unit_weight
            if (allocated(water%pressure)) water%pressure(3, :) = self%water*water%pressure(3, :)
         end associate
      end do
   end subroutine multiply

   !> 'friction 1.25, cohesion 1.25, tension 1.25, water 1, load.traffic 1.3'.
   pure function to_text(self) result(text)
      class(design_factors_type), intent(in) :: self
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, 3
         text = text//trim(factor_names(i))//' '//to_string(self%strength(i))//', '
      end do
      text = text//'water '//to_string(self%water)
      do i = 1, size(self%loads)
         text = text//', '//of_load//trim(self%load_names(i))//' '//to_string(self%loads(i))
      end do
   end function to_text

end module rockdda_run_design_factors
